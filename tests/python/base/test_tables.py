"""Numbers and tables in text."""

import pytest
from chebclear.base import tables


@pytest.mark.parametrize(
    ("value", "digits", "expected"),
    [
        (0.07803, 3, "0.0780"),
        (14.23, 4, "14.23"),
        (9.999, 2, "10"),
        (123456.0, 3, "123456"),
        (1.5e7, 3, "1.50e+07"),
        (-3.0e-7, 3, "-3.00e-07"),
        (0.0, 3, "0"),
        (float("nan"), 3, "-"),
        (float("inf"), 3, "inf"),
    ],
)
def test_format_number(value, digits, expected):
    assert tables.format_number(value, digits) == expected


def test_markdown_table():
    table = tables.markdown_table(["name", "a|b"], [["x", "1"], ["longer", "2.5"]])
    assert table.splitlines() == [
        "| name   | a\\|b |",
        "| ------ | ---: |",
        "| x      |    1 |",
        "| longer |  2.5 |",
    ]
    with pytest.raises(ValueError):
        tables.markdown_table(["a", "b"], [["only one"]])
