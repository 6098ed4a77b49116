"""Bash takes `--set a.b=c` for three words, and puts what is offered in the place of the last of them."""

import contextlib
import io
import os
from collections.abc import Callable


def complete_in_bash(run: Callable[[], None]) -> None:
    """Let `run` print what it offers for words that are whole again, less what bash keeps."""
    words, place = os.environ['COMP_WORDS'].split('\n'), int(os.environ['COMP_CWORD'])
    whole = joined([*words, ''][: place + 1])
    os.environ.update(COMP_WORDS='\n'.join(whole), COMP_CWORD=str(len(whole) - 1))
    kept = whole[-1].rpartition('=')[0] + '=' if '=' in whole[-1] else ''
    offered = io.StringIO()
    try:
        with contextlib.redirect_stdout(offered):
            run()
    finally:
        for line in offered.getvalue().splitlines():
            print(line.removeprefix(kept))


def joined(words: list[str]) -> list[str]:
    """Return `words` with those joined again between which bash has found a `=`."""
    whole: list[str] = []
    for word in words:
        before = whole[-1] if whole else ''
        belongs = word.startswith('=') or before.endswith('=')
        if whole and belongs and not (word.startswith('-') and before.endswith('=')):
            whole[-1] = before + word
        else:
            whole.append(word)
    return whole
