"""``SOCKET ARGUMENT...``: one command of the server of ``warm_commands.py``,
with this process's streams, folder and environment.
"""

import json
import os
import signal
import socket
import sys
import time

HANDED_ON = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def main() -> int:
    path, *arguments = sys.argv[1:]
    # one that comes early waits until it can be handed on
    signal.pthread_sigmask(signal.SIG_BLOCK, HANDED_ON)
    connection = socket.socket(socket.AF_UNIX)
    for _ in range(28000):  # the server still reads its packages
        try:
            connection.connect(path)
            break
        except (FileNotFoundError, ConnectionRefusedError):
            time.sleep(0.01)
    request = {
        "arguments": arguments,
        "folder": os.getcwd(),
        "environment": dict(os.environ),
    }
    socket.send_fds(connection, [json.dumps(request).encode()], [0, 1, 2])
    answer = connection.recv(64)
    pid = int(answer.split()[0])
    for number in HANDED_ON:
        signal.signal(number, lambda which, _: os.kill(pid, which))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, HANDED_ON)
    while answer.count(b"\n") < 2:
        answer += connection.recv(64) or b"1\n"  # the server is gone
    status = int(answer.split()[-1])
    return status if status >= 0 else 128 - status


if __name__ == "__main__":
    sys.exit(main())
