"""Files of other programs, read in a process of their own.

Such a file may be made to take any amount of memory and time. So `read_foreign_file` starts a small process
that reads it, without PyTorch, under the limits of its `FileBudget`, and sends back plain arrays and text.
Nothing of the file is executed or unpickled there either.
"""
