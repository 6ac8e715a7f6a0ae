#!/bin/sh
# SPDX-License-Identifier: MIT
# Streams the demo clip from nginx on loopback, limited to 256 KB/s, and prints what was fetched.
# By hand: tests/player/nginx_stream.sh [BUILD_FOLDER]; needs nginx (Debian: nginx-light) and a
# built test_player. nginx runs from a temporary folder, under its own settings, until the end.
#
# What a client fetched and what the server sent differ where a request has no end: the buffers of
# both kernels fill with what nobody reads. Bounded ranges make them the same.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
build=${1:-$root/build/dev}
port=${PORT:-18256}
folder=$(mktemp -d)
nginx=$(command -v nginx || echo /usr/sbin/nginx)
pid=
stop() {
  [ -z "$pid" ] || kill "$pid" 2>/dev/null || true
  [ -z "$pid" ] || wait "$pid" 2>/dev/null || true
  rm -rf "$folder"
}
trap stop EXIT INT TERM

# Started as root, nginx would read as another user, who may not enter the repository.
cp "$root/media/mannequin.relit" "$folder/"
chmod 755 "$folder"
chmod 644 "$folder/mannequin.relit"
cat >"$folder/nginx.conf" <<CONF
daemon off;
worker_processes 1;
pid $folder/nginx.pid;
error_log $folder/error.log;
events { worker_connections 64; }
http {
  log_format bodies '\$request_uri \$http_range \$status \$body_bytes_sent';
  access_log $folder/access.log bodies;
  client_body_temp_path $folder/body;
  proxy_temp_path $folder/proxy;
  fastcgi_temp_path $folder/fastcgi;
  uwsgi_temp_path $folder/uwsgi;
  scgi_temp_path $folder/scgi;
  types { application/octet-stream relit; }
  server {
    listen 127.0.0.1:$port;
    root $folder;
    limit_rate 256k;
  }
}
CONF
"$nginx" -e "$folder/error.log" -p "$folder" -c "$folder/nginx.conf" &
pid=$!
tries=0
until [ -s "$folder/nginx.pid" ]; do
  tries=$((tries + 1))
  [ "$tries" -lt 50 ] || { cat "$folder/error.log" >&2; exit 1; }
  sleep 0.1
done

RELIT_STREAM=http://127.0.0.1:$port/mannequin.relit "$build/bin/test_player" "[.nginx]"

sleep 1 # until nginx has noticed the last client leave
echo
echo "nginx's own count of the bytes it sent (\$body_bytes_sent):"
awk '{ sent[$1] += $NF; ++requests[$1] }
     END { for (uri in sent) printf "  %s: %d bytes in %d requests\n", uri, sent[uri], requests[uri] }' \
  "$folder/access.log" | sort
