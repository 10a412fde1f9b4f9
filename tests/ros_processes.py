"""Commands in processes of their own, and a node that hears and answers them over ROS 2."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time

DEADLINE = 30.0  # seconds for a condition; a start takes 2 to 4


def wait_until(condition, what, deadline=DEADLINE, pause=0.01):
    """Return the first true value of `condition()`; fail if there is none before the deadline."""
    end = time.monotonic() + deadline
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(pause)
    raise AssertionError(f"no {what} within {deadline:g} s")


class RosProcess:
    """A process with its output by lines, which ends with its test."""

    def __init__(self, *arguments, **environment):
        command = [sys.executable, "-u", *map(str, arguments)]
        self.name = " ".join(command[2:])
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1", **environment},
            start_new_session=True,  # signals reach this process only
        )
        self.lines = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))

    @property
    def text(self):
        return "\n".join(self.lines)

    def mark(self):
        """Return the number of lines so far, for `wait_for(..., since=...)`."""
        return len(self.lines)

    def wait_for(self, *words, since=0, deadline=DEADLINE):
        """Return the first line that contains all words; fail with the output if there is none."""

        def find():
            new = self.lines[since:]
            found = next((line for line in new if all(word in line for word in words)), None)
            if found is None and self.process.poll() is not None and not self._reader.is_alive():
                raise AssertionError(f"{self.name} ended without {words}:\n{self.text}")
            return found

        try:
            return wait_until(find, f"line with {words}", deadline)
        except AssertionError as error:
            raise AssertionError(f"{error}; {self.name} wrote:\n{self.text}") from None

    def signal(self, number):
        """Send a signal."""
        self.process.send_signal(number)

    @contextlib.contextmanager
    def paused(self):
        """Stop the process, and let it continue at the end of the block."""
        self.signal(signal.SIGSTOP)
        try:
            yield
        finally:
            self.signal(signal.SIGCONT)

    def finish(self, number=None, deadline=DEADLINE):
        """Wait for the end, after a signal if one is given, and return the exit status."""
        if number is not None and self.process.poll() is None:
            self.signal(number)
        try:
            status = self.process.wait(deadline)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self.name} did not end; it wrote:\n{self.text}") from None
        self._reader.join(deadline)
        return status

    def kill(self):
        """End the process at once."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._reader.join(DEADLINE)
        self.process.stdout.close()


class Listener:
    """A node of the tests: it stores messages, publishes, and calls services."""

    def __init__(self, domain, name="robsim_test"):
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node(name, context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.heard, self.publishers = {}, {}
        self._work = threading.Lock()
        self._closing = False
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self):
        while not self._closing:
            self.executor.spin_once(timeout_sec=0.02)

    def hear(self, kind, topic, qos=100):
        """Store the messages of a topic from now on, and return their list of (time, message)."""
        if topic in self.heard:
            return self.heard[topic]
        found = self.heard[topic] = []
        self.node.create_subscription(
            kind, topic, lambda message: found.append((time.monotonic(), message)), qos
        )
        return found

    def wait_for(self, topic, condition=bool, since=0, deadline=DEADLINE):
        """Return the first message of a topic after `since` others that meets a condition."""

        def find():
            return next((m for _, m in self.heard[topic][since:] if condition(m)), None)

        return wait_until(find, f"message on {topic}", deadline)

    def publish(self, kind, topic, *messages, wait=True):
        """Publish messages, once a subscriber is there."""
        if topic not in self.publishers:
            self.publishers[topic] = self.node.create_publisher(kind, topic, 10)
        publisher = self.publishers[topic]
        if wait:
            wait_until(publisher.get_subscription_count, f"subscriber of {topic}")
        for message in messages:
            publisher.publish(message)
        return publisher

    def call(self, kind, service, request=None, deadline=DEADLINE):
        """Return the response of a service."""
        client = self.node.create_client(kind, service)
        assert client.wait_for_service(deadline), f"no service {service}"
        future = client.call_async(kind.Request() if request is None else request)
        wait_until(future.done, f"response of {service}", deadline)
        return future.result()

    def close(self):
        """Leave the network."""
        self._closing = True
        self._thread.join(DEADLINE)
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()
