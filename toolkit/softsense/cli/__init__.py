"""The command line: a thin skin, one file per subcommand, found by its folder."""
