"""The work of each command as functions: runs in, result out."""
