#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs an implementation of .relit over the conformance vectors; README.md says what it must do."""

import argparse
import concurrent.futures
import functools
import json
import math
import os
import pathlib
import re
import select
import shlex
import subprocess
import sys
import threading

HERE = pathlib.Path(__file__).resolve().parent


class Mismatch(Exception):
    """What an implementation got wrong, in one line."""


def arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    for name, what in (("info", "prints the parsed structure as JSON"),
                       ("validate", "prints findings as JSON"),
                       ("frames", "prints decoded frames as JSON")):
        parser.add_argument(f"--{name}", metavar="COMMAND", help=f"{what}; {{}} stands for the file")
    parser.add_argument("--serve", metavar="COMMAND", help="a server that runs the others; started once a job")
    parser.add_argument("--vectors", type=pathlib.Path, default=HERE / "vectors", metavar="FOLDER")
    parser.add_argument("--only", default="", metavar="LETTERS", help="vectors whose names begin so")
    parser.add_argument("--timeout", type=float, default=60, metavar="SECONDS", help="of each command")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--ids", type=pathlib.Path, metavar="VALIDATION.md",
                        help="also fail for ids of this page that no vector expects")
    parser.add_argument("--quiet", action="store_true", help="only failures and the summary")
    return parser.parse_args()


class Server:
    """A process that runs one command after the other; README.md says how one talks to it."""

    def __init__(self, command):
        self.process = subprocess.Popen(shlex.split(command), stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def run(self, words, timeout):
        self.process.stdin.write(json.dumps(words).encode() + b"\n")
        self.process.stdin.flush()
        if not select.select([self.process.stdout], [], [], timeout)[0]:
            raise subprocess.TimeoutExpired(words, timeout)
        done = json.loads(self.process.stdout.readline() or '{"status": -1, "output": ""}')
        return done["status"], done["output"]

    def stop(self):
        self.process.stdin.close()
        self.process.kill()
        self.process.wait()


class Runner:
    """Runs commands, for each thread with a server of its own if there is one."""

    def __init__(self, serve, timeout):
        self.serve, self.timeout = serve, timeout
        self.servers = {}

    def run(self, command, path):
        """Exit status and standard output; a crash or a hang is a mismatch for every vector."""
        words = [word.replace("{}", str(path)) for word in shlex.split(command)]
        if "{}" not in command:
            words.append(str(path))
        try:
            status, output = self.serving(words) if self.serve else self.starting(words)
        except subprocess.TimeoutExpired:
            raise Mismatch(f"still running after {self.timeout:g} s") from None
        except BrokenPipeError:
            raise Mismatch("the server is gone") from None
        if status < 0 or status > 125:
            raise Mismatch(f"crashed with status {status}")
        return status, output

    def starting(self, words):
        done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True,
                              timeout=self.timeout, check=False)
        return done.returncode, done.stdout

    def serving(self, words):
        thread = threading.get_ident()
        server = self.servers.pop(thread, None) or Server(self.serve)
        try:
            done = server.run(words, self.timeout)
        except BaseException:  # one that does not answer is of no more use
            server.stop()
            raise
        self.servers[thread] = server
        return done

    def stop(self):
        for server in self.servers.values():
            server.stop()


def parsed(output):
    try:
        return json.loads(output)
    except (ValueError, UnicodeDecodeError) as error:
        raise Mismatch(f"does not print JSON: {error}") from None


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def compare(expected, got, where, tolerance):
    """Everything expected must be there; objects may hold more."""
    if isinstance(expected, dict) and isinstance(got, dict):
        for key, value in expected.items():
            if key not in got:
                raise Mismatch(f"{where}.{key} is missing")
            compare(value, got[key], f"{where}.{key}", 1e-3 if key == "normals" else tolerance)
    elif isinstance(expected, list) and isinstance(got, list):
        if len(expected) != len(got):
            raise Mismatch(f"{where} has {len(got)} entries, not {len(expected)}")
        for i, (a, b) in enumerate(zip(expected, got)):
            compare(a, b, f"{where}[{i}]", tolerance)
    elif is_number(expected) and is_number(got):
        exact = isinstance(expected, int) and isinstance(got, int)
        if expected != got if exact else not math.isclose(expected, got, rel_tol=tolerance, abs_tol=tolerance):
            raise Mismatch(f"{where} is {got}, not {expected}")
    elif type(expected) is not type(got) or expected != got:
        raise Mismatch(f"{where} is {json.dumps(got)}, not {json.dumps(expected)}")


def check_info(vector, run):
    status, output = run()
    if vector["outcome"] == "whole":
        if status != 0:
            raise Mismatch(f"ends with status {status}, the file can be read")
        # An f32 printed with 7 digits or more is the same number.
        compare(vector["info"] or {}, parsed(output), "info", 1e-6)
    elif status == 0:
        raise Mismatch("ends with status 0, although records are " +
                       ("lost" if vector["outcome"] == "lossy" else "unreadable"))
    elif vector["outcome"] == "lossy" and not isinstance(parsed(output), dict):
        raise Mismatch("does not print what is left")


def check_validate(vector, run):
    status, output = run()
    report = parsed(output)
    files = report.get("files", [report])
    got = {finding["id"] for file in files for finding in file["findings"]}
    expected = set(vector["findings"])
    problems = [f"misses {name}" for name in sorted(expected - got)]
    problems += [f"reports {name}" for name in sorted(got - expected)]
    if (status == 0) != vector["valid"]:
        problems.append(f"ends with status {status}")
    if problems:
        raise Mismatch(", ".join(problems))


def frames_of(decoded):
    return [frame for model in decoded.get("models", []) for frame in model["frames"] if frame]


def has_normals(decoded):
    """Implementations that do not predict leave them out."""
    return any("normals" in frame for frame in frames_of(decoded))


def without_normals(decoded):
    decoded = json.loads(json.dumps(decoded))
    for frame in frames_of(decoded):
        frame.pop("normals", None)
    return decoded


def check_frames(vector, run):
    status, output = run()
    if vector["frames"] is None:
        if status == 0:
            raise Mismatch("decodes what cannot be decoded")
        return
    if status != 0:
        raise Mismatch(f"ends with status {status}, the file can be decoded")
    # Samples are exact; coefficients are sums of a few products, each within 2^-24.
    got = parsed(output)
    expected = vector["frames"] if has_normals(got) else without_normals(vector["frames"])
    compare(expected, got, "frames", 1e-5)


CHECKS = {"info": check_info, "validate": check_validate, "frames": check_frames}


def check(path, commands, runner):
    vector = json.loads(path.read_text())
    results = {}
    for name, command in commands.items():
        try:
            CHECKS[name](vector, functools.partial(runner.run, command, path.with_suffix(".relit")))
            results[name] = None
        except Mismatch as mismatch:
            results[name] = str(mismatch)
        except (KeyError, TypeError, AttributeError) as error:
            results[name] = f"prints JSON of another shape: {error!r}"
    return vector, results


def missing_ids(page, vectors):
    """Ids begin the rows of the tables of VALIDATION.md."""
    listed = set(re.findall(r"^\| `([A-Z]+_[A-Z_]+)` \|", page.read_text(), re.MULTILINE))
    return sorted(listed - {name for vector in vectors for name in vector["findings"]})


def main():
    options = arguments()
    commands = {name: getattr(options, name) for name in CHECKS if getattr(options, name)}
    paths = sorted(p for p in options.vectors.glob("*.json") if p.name.startswith(options.only))
    paths = [p for p in paths if p.with_suffix(".relit").exists()]
    if not paths:
        print(f"run.py: no vectors in {options.vectors}", file=sys.stderr)
        return 2
    if not commands:
        print("run.py: name at least one of --info, --validate and --frames", file=sys.stderr)
        return 2
    runner = Runner(options.serve, options.timeout)
    with concurrent.futures.ThreadPoolExecutor(max(1, options.jobs)) as pool:
        checked = list(pool.map(lambda p: check(p, commands, runner), paths))
    runner.stop()

    width = max(len(path.stem) for path in paths)
    print(f"{'vector':{width}}  " + "  ".join(f"{name:8}" for name in commands))
    failures = dict.fromkeys(commands, 0)
    for path, (_, results) in zip(paths, checked):
        bad = {name: text for name, text in results.items() if text}
        if bad or not options.quiet:
            cells = "  ".join(f"{'FAILED' if text else 'ok':8}" for text in results.values())
            print(f"{path.stem:{width}}  {cells}".rstrip())
        for name, text in bad.items():
            failures[name] += 1
            print(f"{'':{width}}  {name}: {text}")
    for name, count in failures.items():
        print(f"{name}: {len(paths) - count} of {len(paths)} vectors pass")
    failed = any(failures.values())
    if options.ids:
        for name in missing_ids(options.ids, [vector for vector, _ in checked]):
            print(f"no vector expects {name}")
            failed = True
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
