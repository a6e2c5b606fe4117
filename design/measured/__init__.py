"""A model beside the logs of its machine: what it predicts of them, and frequency responses."""
