"""Tasks of robots, with the judges that tell whether they were done."""
