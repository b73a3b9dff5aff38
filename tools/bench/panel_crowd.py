"""Connections of strangers at the panel: idle, slow and flooding ones, from a process of their own.

``python panel_crowd.py PORT IDLE SLOW FLOODING``: says ``ready`` once they are there, and ends with standard input.
"""

from __future__ import annotations

import asyncio
import contextlib
import resource
import sys

REQUEST = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
PRESS = (
    b"POST /press HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    b'Content-Length: 25\r\n\r\n{"verb":"emergency_stop"}'
)


async def crowd(port: int, idle: int, slow: int, flooding: int) -> None:
    """Until standard input ends."""

    async def stay() -> None:
        while True:
            with contextlib.suppress(OSError):
                reader, writer = await asyncio.open_connection("127.0.0.1", port)
                await reader.read()
                writer.close()
            await asyncio.sleep(5.0)

    async def dawdle() -> None:
        while True:
            with contextlib.suppress(OSError):
                _, writer = await asyncio.open_connection("127.0.0.1", port)
                for byte in REQUEST:
                    writer.write(bytes([byte]))
                    await writer.drain()
                    await asyncio.sleep(0.2)
                writer.close()

    async def flood(number: int) -> None:
        while True:
            with contextlib.suppress(OSError):
                reader, writer = await asyncio.open_connection("127.0.0.1", port)
                writer.write((REQUEST if number % 2 else PRESS) * 20)
                if number % 4 < 2:
                    await reader.read()
                writer.close()
                await asyncio.sleep(0.0)

    tasks = [asyncio.create_task(stay()) for _ in range(idle)]
    tasks += [asyncio.create_task(dawdle()) for _ in range(slow)]
    await asyncio.sleep(2.0)
    tasks += [asyncio.create_task(flood(number)) for number in range(flooding)]
    print("ready", flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    for task in tasks:
        task.cancel()


if __name__ == "__main__":
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 8192), hard))
    asyncio.run(crowd(*map(int, sys.argv[1:])))
