"""How a value that is not valid has to be refused."""

import pytest

from drake_mobarm.exceptions import ParameterError


def assert_refused(name, call, /, *arguments, **keywords):
    """A call is refused in one line: what, its value, and what is valid.

    Args:
        name: what is refused, as the line begins; a regular expression.
        call: is called with the other arguments.
        arguments: of the call.
        keywords: of the call.
    """
    with pytest.raises(ParameterError, match=rf"^{name}(?!\w)") as caught:
        call(*arguments, **keywords)
    assert isinstance(caught.value, ValueError)
    message = str(caught.value)
    assert "\n" not in message
    assert "valid is " in message or "valid are " in message
