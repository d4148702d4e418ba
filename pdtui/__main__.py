"""`python -m pdtui` is `pdtui`."""

from pdtui.cli import main

if __name__ == "__main__":
    main()
