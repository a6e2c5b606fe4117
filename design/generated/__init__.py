"""A controller and the tables of a model as code: texts and values, for files of the shell."""
