#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Serves one file over HTTP and misbehaves as asked: `http_server.py FILE LOG`.

Prints its port, then serves 127.0.0.1 until standard input ends. The address chooses the fault,
/MODE or /MODE/NUMBER; anything behind that only tells runs apart:

  ok               byte ranges as they should be
  plain            no byte ranges: 200 with everything
  status/CODE      that status
  redirect         to itself, for ever
  mute             takes the request and says nothing
  hangup           takes the request and closes the connection
  stall/N          says nothing more at byte N of the file
  cut/N            closes the connection at byte N, the first time only
  end/N            closes the connection at byte N, every time
  plaincut/N       as plain and cut
  short/N, long/N  as plain, but Content-Length says N bytes too few or too many
  grows            N bytes longer from the second request on (N = 8)
  swaps            from the second request on other bytes of the same length, and another ETag
  slow/N           N bytes a second
  header           403 unless there is "X-Relit-Test: yes"

A line of LOG for each request: its range or "-", the status, and the bytes of the body that were
sent. A request that is still being answered has no line yet.
"""
import http.server
import re
import socket
import sys
import threading
import time

DATA = open(sys.argv[1], "rb").read()
LOG = open(sys.argv[2], "a", buffering=1)
LOCK = threading.Lock()
SEEN = {}
STEP = 4096


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def note(self, status, sent):
        with LOCK:
            LOG.write(f"{self.headers.get('Range', '-')} {status} {sent}\n")

    def refuse(self, status, headers=()):
        self.send_response(status)
        for name, value in headers:
            self.send_header(name, value)
        self.send_header("Content-Length", "0")
        self.send_header("Connection", "close")
        self.end_headers()
        self.note(status, 0)

    def wait_for_client(self):
        """Says nothing until the client has gone."""
        try:
            while self.connection.recv(1):
                pass
        except OSError:
            pass

    def do_GET(self):
        self.close_connection = True
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, STEP)
        parts = self.path.strip("/").split("/")
        mode = parts[0]
        number = int(parts[1]) if len(parts) > 1 and parts[1].isdigit() else 0
        with LOCK:
            SEEN[self.path] = SEEN.get(self.path, 0) + 1
            turn = SEEN[self.path]
        if mode == "status":
            return self.refuse(number)
        if mode == "redirect":
            return self.refuse(302, [("Location", self.path)])
        if mode == "header" and self.headers.get("X-Relit-Test") != "yes":
            return self.refuse(403)
        if mode in ("mute", "hangup"):
            if mode == "mute":
                self.wait_for_client()
            return self.note(0, 0)
        self.answer(mode, number, turn)

    def answer(self, mode, number, turn):
        data = DATA
        etag = '"one"'
        if mode == "grows" and turn > 1:
            data = DATA + bytes(8)
        if mode == "swaps" and turn > 1:
            data, etag = bytes(b ^ 0x55 for b in DATA), '"two"'
        plain = mode in ("plain", "plaincut", "short", "long")
        wanted = re.fullmatch(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
        begin, end = 0, len(data)
        if wanted and not plain:
            begin = int(wanted[1])
            end = min(end, int(wanted[2]) + 1) if wanted[2] else end
        if begin >= end and begin > 0:
            return self.refuse(416, [("Content-Range", f"bytes */{len(data)}")])
        status = 206 if wanted and not plain else 200
        self.send_response(status)
        if status == 206:
            self.send_header("Content-Range", f"bytes {begin}-{end - 1}/{len(data)}")
        lie = {"short": -number, "long": number}.get(mode, 0)
        self.send_header("Content-Length", str(end - begin + lie))
        self.send_header("ETag", etag)
        self.send_header("Connection", "close")
        self.end_headers()
        stop = end
        if mode in ("stall", "end") or (mode in ("cut", "plaincut") and turn == 1):
            stop = min(end, max(begin, number))
        sent = self.send_body(data[begin:stop], number if mode == "slow" else 0)
        if mode == "stall" and stop < end:
            self.wait_for_client()
        self.note(status, sent)

    def send_body(self, body, rate):
        sent = 0
        try:
            while sent < len(body):
                sent += self.connection.send(body[sent : sent + STEP])
                if rate:
                    time.sleep(STEP / rate)
        except OSError:
            pass
        return sent


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request, client_address):
        """A client that left in the middle is what many of the tests are about."""


server = Server(("127.0.0.1", 0), Handler)
threading.Thread(target=server.serve_forever, daemon=True).start()
print(server.server_address[1], flush=True)
sys.stdin.read()
