"""What the notices of a result are about."""


def codes(result):
    """Codes of the notices of a result."""
    return {notice.code for notice in result.notices}
