"""The table of a campaign at the end of its run."""

from robustness.campaign import SHARE, table


def pytest_terminal_summary(terminalreporter):
    """Print the table, unless the campaign is reduced."""
    if SHARE:
        terminalreporter.section("robustness")
        for line in table():
            terminalreporter.write_line(line)
