#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs SCRIPT many times while Python and what it imports are loaded once: serve.py SCRIPT.

The protocol is that of `run.py --serve`: a line of standard input is the JSON list of a command's
words; its main() runs in a fork, and the answer is a line of JSON with its status and output.
"""
import importlib.util
import json
import os
import sys
import tempfile
import traceback


def status_of(main, words):
    """What the script would have ended with."""
    sys.argv[1:] = words
    try:
        return main() or 0
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
        return end.code if isinstance(end.code, int) else int(bool(end.code))
    except BaseException:  # as the interpreter does
        traceback.print_exc()
        return 1


def answer(main, words):
    with tempfile.TemporaryFile() as output:
        child = os.fork()
        if not child:
            os.dup2(output.fileno(), 1)
            status = status_of(main, words)
            sys.stdout.flush()
            os._exit(status)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        output.seek(0)
        return {"status": status, "output": output.read().decode(errors="replace")}


if __name__ == "__main__":
    sys.argv[:] = sys.argv[1:]
    spec = importlib.util.spec_from_file_location("script", sys.argv[0])
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    for line in sys.stdin:
        print(json.dumps(answer(script.main, json.loads(line))), flush=True)
