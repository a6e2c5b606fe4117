"""Jobs: new logs of many machines judged by themselves, once each, whatever dies on the way."""
