"""Several paths after one option: `--train a b --held-out c`, as one knows it from other tools."""

from collections.abc import Sequence

SEVERAL = ('--train', '--held-out', '--file')


def with_repeated_options(arguments: Sequence[str], several: Sequence[str] = SEVERAL) -> list[str]:
    """Return `arguments` with an option of `several` repeated before each of the values that follow it.

    Values end at the next word that begins with a dash. All else stays as it is.
    """
    result: list[str] = []
    option, filled = '', True
    for number, word in enumerate(arguments):
        if word == '--':
            return [*result, *arguments[number:]]
        if word.startswith('-') and word != '-':
            option, filled = (word, False) if word in several else ('', True)
            result.append(word)
        elif option and filled:
            result += [option, word]
        else:
            result.append(word)
            filled = True
    return result
