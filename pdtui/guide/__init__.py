"""The documentation, as Markdown: for the terminal (`pdtui guide`), the site and the tests."""
