"""Jobs: new logs of many machines tested automatically, once each, whatever dies on the way."""
