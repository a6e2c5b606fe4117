"""The plant as equations: Karnopp friction, actuator, inverse model, and estimates of them."""
