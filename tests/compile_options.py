"""Of a compile command what decides how a file reads: for checks that compile single files, syntax only."""

import pathlib, shlex


def options(command, drop=("-O", "-W")):
    """The compiler and its words, without launcher, input, output and dependency files, and without what begins with one of `drop`."""
    words, kept, skip = shlex.split(command), [], False
    while words and pathlib.Path(words[0]).name in ("ccache", "sccache", "distcc"):
        words.pop(0)
    for word in words:
        if skip:
            skip = False
        elif word in ("-o", "-MF", "-MT", "-MQ", "-c"):
            skip = True
        elif word not in ("-MD", "-MMD") and not word.startswith(tuple(drop)):
            kept.append(word)
    return kept
