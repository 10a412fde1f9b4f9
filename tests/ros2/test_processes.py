"""The processes and the listener of these tests themselves."""

import signal

import pytest
from ros_processes import wait_until
from std_msgs.msg import Float64MultiArray

ECHO = """
import rclpy
from std_msgs.msg import Float64MultiArray as Numbers
rclpy.init()
node = rclpy.create_node("echo")
back = node.create_publisher(Numbers, "/back", 10)
node.create_subscription(Numbers, "/there", back.publish, 10)
print("ready")
rclpy.spin(node)
"""


def test_messages_go_to_a_process_and_back(start, listener):
    echo = start("-c", ECHO)
    echo.wait_for("ready")
    heard = listener.hear(Float64MultiArray, "/back")
    wait_until(lambda: listener.node.count_publishers("/back"), "publisher of /back")
    sent = listener.publish(Float64MultiArray, "/there", Float64MultiArray(data=[1.0]))
    wait_until(lambda: heard or sent.publish(Float64MultiArray(data=[1.0])), "answer", pause=0.1)
    assert list(heard[0][1].data) == [1.0]
    assert echo.finish(signal.SIGKILL) == -signal.SIGKILL


def test_a_process_that_ends_early_is_a_failure_with_its_output(start):
    process = start("-c", "print('only this')")
    with pytest.raises(AssertionError, match="only this"):
        process.wait_for("ready")
    assert process.finish() == 0
