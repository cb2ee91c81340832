"""Ask one model server: bounded in time, number and size, tried again where that may help."""

import itertools
from collections.abc import Callable
from typing import Any

from drivers.clock import NS_PER_S, Clock
from vla_deploy.model_servers.calls.exchange import Exchange, document_of
from vla_deploy.model_servers.calls.limits import (
    Admission,
    Backoff,
    BreakerState,
    CallRate,
    CircuitBreaker,
    bounded_s,
    may_pass,
)
from vla_deploy.model_servers.calls.privacy import check_privacy
from vla_deploy.model_servers.chat import Chat, Completion
from vla_deploy.model_servers.errors import (
    AnswerUnusable,
    ModelServerError,
    ServerFailed,
    ServerRefused,
    Unavailable,
)
from vla_deploy.model_servers.formats import FORMATS
from vla_deploy.model_servers.formats.base import Format, Json, ModelFacts, WireRequest
from vla_deploy.model_servers.metrics import CallMetrics
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.deadline import Deadline
from vla_deploy.runtime.secret import Secret


class ModelServer:
    """Hold one declared server and how it has been doing; threads may share it.

    Calls block: make them from an executor of `vla_deploy.runtime.executors`, not from a step.
    """

    def __init__(
        self,
        name: str,
        settings: ServerSettings,
        key: Secret | None,
        exchange: Exchange,
        clock: Clock,
        draw: Callable[[], float],
    ) -> None:
        self.name = name
        self.settings = settings
        self.clock = clock
        self.format: Format = FORMATS[settings.api]
        self._key = key
        self._exchange = exchange
        self._admission = Admission(settings.max_calls, settings.max_waiting)
        self._rate = CallRate(settings.max_calls_per_minute, clock)
        self._breaker = CircuitBreaker(settings.breaker_failures, settings.breaker_open_s, clock)
        self._backoff = Backoff(
            first_s=settings.backoff_s, longest_s=settings.backoff_max_s, draw=draw
        )
        self._metrics = CallMetrics()

    def deadline(self, within_s: float | None = None) -> Deadline:
        """Return the deadline of a call that begins now; `within_s` can only make it sooner."""
        longest_s = self.settings.total_timeout_s
        return Deadline.within(self.clock, min(within_s or longest_s, longest_s))

    def complete(
        self,
        chat: Chat,
        mode: str | None = None,
        deadline: Deadline | None = None,
        final: frozenset[int] = frozenset(),
    ) -> Completion:
        """Ask the model once, and again while that may help and time is left.

        `mode` is one of `format.schema_modes`, the strictest by default. `final` are statuses of
        HTTP that are taken for an answer to this mode, and not tried again.

        Raises:
            PrivacyRefused: that may not leave the robot, or the server is not where it should be.
            ServerRefused: the server will not answer this.
            Unavailable: there is no answer now.
            AnswerUnusable: the answer cannot be used.
        """
        ends = deadline or self.deadline()
        began_ns = self.clock.now_ns()
        try:
            check_privacy(self.name, self.settings, chat)
            if chat.has_images and not self.settings.vision:
                raise ServerRefused(f"server {self.name} takes no images; it has no vision = true")
            request = self.format.request(self.settings, chat, mode or self.format.schema_modes[0])
            self._rate.take()
            with self._admission.place(ends):
                reply = self._send_patiently(request, ends, final)
            completion = self.format.completion(reply)
        except ModelServerError as error:
            self._metrics.failed(error)
            raise
        self._metrics.answered(completion, (self.clock.now_ns() - began_ns) / NS_PER_S)
        return completion

    def models(self) -> ModelFacts:
        """Ask what the server says of its models; no text or image of the robot is in it.

        Raises:
            ServerRefused: the server does not say.
            Unavailable: there is no answer now.
            AnswerUnusable: the answer cannot be used.
        """
        ends = self.deadline()
        first, *others = self.format.listing(self.settings)
        replies = [self._known(first, ends), *(self._known(one, ends) for one in others)]
        return self.format.facts(self.settings, tuple(replies))

    def document(self) -> dict[str, Any]:
        """Return how the server has been doing, for status and metrics."""
        return {
            "server": self.name,
            "api": str(self.settings.api),
            "model": self.settings.model,
            "location": str(self.settings.location),
            "breaker": str(self._breaker.state),
            "active": self._admission.active,
            "waiting": self._admission.waiting,
            **self._metrics.document(),
        }

    def _known(self, request: WireRequest, ends: Deadline) -> Json | None:
        """Return a reply about models; None where the server knows nothing of what is asked."""
        try:
            return self._send(request, ends)
        except ServerRefused as error:
            if error.status == 404:
                return None
            raise

    def _send_patiently(self, request: WireRequest, ends: Deadline, final: frozenset[int]) -> Json:
        for failures in itertools.count(1):
            try:
                return self._send_if_admitted(request, ends)
            except ModelServerError as error:
                wait_s = self._backoff.wait_s(failures, error)
                is_final = isinstance(error, ServerFailed) and error.status in final
                worth = self._is_worth_a_retry(error, failures) and not is_final
                if not worth or wait_s >= ends.left_s:
                    raise
            self.clock.sleep_until(self.clock.now_ns() + round(wait_s * NS_PER_S))
            self._metrics.retried()
        raise AssertionError("the last attempt returns or raises")

    def _is_worth_a_retry(self, error: ModelServerError, failures: int) -> bool:
        closed = self._breaker.state is BreakerState.CLOSED
        return closed and may_pass(error) and failures < self.settings.max_attempts

    def _send_if_admitted(self, request: WireRequest, ends: Deadline) -> Json:
        bounded_s(ends)  # before it is admitted: what is not sent says nothing about the server
        self._breaker.admit()
        try:
            reply = self._send(request, ends)
        except Unavailable:
            if ends.is_recalled:
                self._breaker.abandoned()  # the person would not wait; the server may be well
            else:
                self._breaker.failed()
            raise
        except (AnswerUnusable, ServerRefused):
            self._breaker.succeeded()  # it answers, whatever that is worth
            raise
        except BaseException:
            self._breaker.abandoned()
            raise
        self._breaker.succeeded()
        return reply

    def _send(self, request: WireRequest, ends: Deadline) -> Json:
        reply = self._exchange.send(request, self.format.headers(self._key), ends)
        return document_of(reply, self.settings, self._key)
