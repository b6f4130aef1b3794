"""`python -m cli` is `sonarlog`."""

from cli.main import main

main()
