# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The executor of the nodes: messages, everything else, changes, and the end."""

from __future__ import annotations

import ast
import inspect
import re
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

from gait_segmentation.ros import executor
from gait_segmentation.ros.executor import MessageExecutor

_PATIENCE_S = 300.0


class _Bench:
    """A node that is spun in a thread."""

    def __init__(self) -> None:
        self.context = Context()
        rclpy.init(args=[], context=self.context)
        self.node = Node('spun', context=self.context, start_parameter_services=False)
        self.executor = MessageExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.error: BaseException | None = None
        self._thread = threading.Thread(target=self._spin, daemon=True)

    def start(self) -> None:
        self._thread.start()

    def ended(self) -> bool:
        self._thread.join(_PATIENCE_S)
        return not self._thread.is_alive()

    def close(self) -> None:
        self.executor.shutdown()
        if self._thread.ident is not None:
            assert self.ended()
        self.node.destroy_node()
        self.context.try_shutdown()

    def _spin(self) -> None:
        try:
            self.executor.spin()
        except BaseException as error:
            self.error = error


@pytest.fixture
def bench() -> Iterator[_Bench]:
    made = _Bench()
    yield made
    made.close()


def _wait(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + _PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.002)


def _connected(publisher: Any, count: int = 1) -> Callable[[], bool]:
    return lambda: publisher.get_subscription_count() == count


def test_messages_come_in_order_without_gathering_for_each(bench: _Bench, monkeypatch) -> None:
    gathered = []
    nodes = bench.executor.get_nodes
    monkeypatch.setattr(bench.executor, 'get_nodes', lambda: gathered.append(1) or nodes())
    got: list[int] = []
    bench.node.create_subscription(Int32, 'number', lambda each: got.append(each.data), 200)
    publisher = bench.node.create_publisher(Int32, 'number', 200)
    bench.start()
    _wait(_connected(publisher))
    for number in range(100):
        publisher.publish(Int32(data=number))
        _wait(lambda: len(got) > number)  # noqa: B023
    assert got == list(range(100))
    assert len(gathered) < 50


def test_timers_services_and_guards_run_beside_messages(bench: _Bench) -> None:
    ticks: list[int] = []
    got: list[int] = []
    alarms: list[int] = []

    def answer(_request: Any, response: Any) -> Any:
        response.success = True
        return response

    bench.node.create_timer(0.02, lambda: ticks.append(1))
    bench.node.create_service(Trigger, 'trigger', answer)
    client = bench.node.create_client(Trigger, 'trigger')
    alarm = bench.node.create_guard_condition(lambda: alarms.append(1))
    bench.node.create_subscription(Int32, 'number', lambda each: got.append(each.data), 10)
    publisher = bench.node.create_publisher(Int32, 'number', 10)
    bench.start()
    _wait(lambda: client.service_is_ready() and publisher.get_subscription_count() == 1)
    for number in range(1, 6):
        before = len(ticks)
        answered = client.call_async(Trigger.Request())
        alarm.trigger()
        publisher.publish(Int32(data=number))
        _wait(lambda: answered.done() and len(alarms) == number and len(got) == number)  # noqa: B023
        assert answered.result().success
        _wait(lambda: len(ticks) > before + 1)  # noqa: B023


def test_callbacks_may_make_and_destroy_subscriptions(bench: _Bench) -> None:
    first: list[int] = []
    second: list[int] = []
    old: Any = None

    def renew(message: Int32) -> None:
        first.append(message.data)
        bench.node.destroy_subscription(old)
        bench.node.create_subscription(Int32, 'number', lambda each: second.append(each.data), 10)

    old = bench.node.create_subscription(Int32, 'number', renew, 10)
    publisher = bench.node.create_publisher(Int32, 'number', 10)
    bench.start()
    _wait(_connected(publisher))
    publisher.publish(Int32(data=1))
    _wait(lambda: bool(first))
    # The one is let go of and the other found, in either order.
    _wait(lambda: len(list(bench.node.subscriptions)) == 1)
    deadline = time.monotonic() + _PATIENCE_S
    while not second and time.monotonic() < deadline:
        publisher.publish(Int32(data=2))
        time.sleep(0.02)
    assert first == [1]
    assert set(second) == {2}


def test_an_error_of_a_callback_ends_the_spinning(bench: _Bench) -> None:
    def fail(_message: Int32) -> None:
        raise ValueError('no use')

    bench.node.create_subscription(Int32, 'number', fail, 10)
    publisher = bench.node.create_publisher(Int32, 'number', 10)
    bench.start()
    _wait(_connected(publisher))
    publisher.publish(Int32())
    assert bench.ended()
    assert isinstance(bench.error, ValueError)


def test_tasks_and_nodes_given_from_elsewhere_are_noticed(bench: _Bench) -> None:
    done: list[str] = []
    got: list[int] = []
    bench.start()
    bench.executor.create_task(done.append, 'task')
    _wait(lambda: done == ['task'])
    # Also of one that a task or a callback makes.
    bench.executor.create_task(lambda: bench.executor.create_task(done.append, 'another'))
    _wait(lambda: done == ['task', 'another'])
    other = Node('other', context=bench.context, start_parameter_services=False)

    def later(message: Int32) -> None:
        bench.executor.create_task(got.append, message.data)

    other.create_subscription(Int32, 'number', later, 10)
    publisher = bench.node.create_publisher(Int32, 'number', 10)
    assert bench.executor.add_node(other)
    assert not bench.executor.add_node(other)
    _wait(_connected(publisher))
    publisher.publish(Int32(data=7))
    _wait(lambda: got == [7])
    bench.executor.remove_node(other)
    assert bench.executor.get_nodes() == [bench.node]
    other.destroy_node()


def test_nothing_private_of_rclpy_is_used(bench: _Bench) -> None:
    """What rclpy keeps to itself may be gone with its next release."""
    made, used = set(), set()
    for each in ast.walk(ast.parse(inspect.getsource(executor))):
        if isinstance(each, ast.FunctionDef | ast.ClassDef):
            made.add(each.name)
        elif isinstance(each, ast.Attribute):
            (made if isinstance(each.ctx, ast.Store) else used).add(each.attr)
    used = {name for name in used if re.match('_[a-z]', name)}
    assert used <= made
    rclpys = SingleThreadedExecutor(context=bench.context)
    assert used.isdisjoint(dir(rclpys))
    rclpys.shutdown()


def test_it_ends_with_the_executor_and_with_the_context(bench: _Bench) -> None:
    bench.start()
    bench.executor.shutdown()
    assert bench.ended()
    assert bench.error is None
    other = _Bench()
    other.start()
    other.context.shutdown()
    assert other.ended()
    # Noticed before the next wait, or by it.
    assert other.error is None or isinstance(other.error, ExternalShutdownException)
    other.close()
