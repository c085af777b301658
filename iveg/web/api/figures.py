"""Figures of the history over HTTP, and the library that draws them."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated

from fastapi import APIRouter, HTTPException, Query, Response
from orjson import Fragment

from iveg.adapters.history import command_latencies, confidence, series
from iveg.adapters.history.command_latencies import CommandLatency
from iveg.adapters.history.confidence import ConfidenceCount
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.series import ClimateSeries, MeasurementSeries, SpeedSeries
from iveg.domain.fleet import FleetDescription
from iveg.domain.stamps import format_stamp
from iveg.models.base import write_json
from iveg.models.climate import ClimateReading
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Apart
from iveg.web.api.exports import MEDIA_TYPES
from iveg.web.api.history_filters import Range, Span, range_of
from iveg.web.pages import charts, plotly_library, time_charts

_DAY_S = 86_400.0
_FOR_GOOD = "public, max-age=31536000, immutable"


def add_routes(
    routes: APIRouter,
    queries: Queries,
    worker: Apart,
    threshold: Callable[[], float | None],
    fleet: FleetDescription,
    read_clock: Clock,
) -> None:
    """Add the figures to the routes of the history, whose arguments these are."""

    @routes.get(
        "/api/v1/history/charts",
        summary="Plotly figures of a range",
        description="Speed with the speed limit, detections by class and "
        "confidence, how long each STOP took; the last 15 minutes unless told.",
        response_class=Response,
        responses={200: {"content": {"application/json": {}}}},
    )
    async def draw(asked: Annotated[Range, Query()]) -> Response:
        since, until = range_of(asked, read_clock().wall)
        found = await asyncio.gather(
            queries.ask(series.speed_series, since, until, asked.robot),
            queries.ask(confidence.confidence_counts, since, until, asked.robot),
            queries.ask(command_latencies.command_latencies, since, until, asked.robot),
        )
        body = await worker.run(_draw_charts, *found, threshold(), fleet)
        return Response(body, media_type=MEDIA_TYPES["json"])

    @routes.get("/vendor/{name}", include_in_schema=False)
    async def vendor(name: str) -> Response:
        script = await asyncio.to_thread(plotly_library.library)
        if name != script.name:
            raise HTTPException(404, "There is no such file.")
        headers = {"Content-Encoding": "gzip", "Cache-Control": _FOR_GOOD}
        return Response(script.packed, 200, headers, "text/javascript")

    _add_spans(routes, queries, worker, read_clock)


def _add_spans(
    routes: APIRouter, queries: Queries, worker: Apart, read_clock: Clock
) -> None:
    """Add what is measured all day."""

    @routes.get(
        "/api/v1/history/climate",
        summary="The air over a range",
        description="Readings, or their means over slices of time, and Plotly figures "
        "of them; the last 24 hours unless told.",
        response_class=Response,
        responses={200: {"content": {"application/json": {}}}},
    )
    async def climate(asked: Annotated[Span, Query()]) -> Response:
        since, until = range_of(asked, read_clock().wall, _DAY_S)
        found = await queries.ask(series.climate_series, since, until)
        body = await worker.run(_draw_climate, found, since, until)
        return Response(body, media_type=MEDIA_TYPES["json"])

    @routes.get(
        "/api/v1/history/equipment",
        summary="Other equipment over a range",
        description="A Plotly figure of each attribute that was heard, by entity and "
        "attribute; the last 24 hours unless told.",
        response_class=Response,
        responses={200: {"content": {"application/json": {}}}},
    )
    async def equipment(asked: Annotated[Span, Query()]) -> Response:
        since, until = range_of(asked, read_clock().wall, _DAY_S)
        found = await queries.ask(series.measurement_series, since, until)
        body = await worker.run(_draw_equipment, found, since, until)
        return Response(body, media_type=MEDIA_TYPES["json"])


def _draw_charts(
    speeds: Sequence[SpeedSeries],
    counts: Sequence[ConfidenceCount],
    stops: Sequence[CommandLatency],
    threshold: float | None,
    fleet: FleetDescription,
) -> bytes:
    return write_json(
        {
            **plotly_library.library_facts(),
            "speed": Fragment(time_charts.speed_figure(speeds, fleet)),
            "margin": Fragment(time_charts.margin_figure(speeds)),
            "detections": Fragment(charts.confidence_figure(counts, threshold)),
            "stops": Fragment(charts.stop_figure(stops)),
        }
    )


def _draw_climate(series: ClimateSeries, since: float, until: float) -> bytes:
    figures = time_charts.climate_figures(series)
    return write_json(
        {
            "since": format_stamp(since),
            "until": format_stamp(until),
            "slice_s": round(series.slice_s, 3),
            "items": _readings(series),
            **plotly_library.library_facts(),
            "figures": {kind: Fragment(drawn) for kind, drawn in figures.items()},
        }
    )


def _draw_equipment(
    series: Mapping[tuple[str, str], MeasurementSeries], since: float, until: float
) -> bytes:
    figures = {
        f"{entity_id}/{attribute}": Fragment(time_charts.measurement_figure(one))
        for (entity_id, attribute), one in series.items()
    }
    return write_json(
        {
            "since": format_stamp(since),
            "until": format_stamp(until),
            **plotly_library.library_facts(),
            "figures": figures,
        }
    )


def _readings(series: ClimateSeries) -> list[ClimateReading]:
    """Oldest first."""
    columns = (series.at, series.temperature, series.relative_humidity, series.co2)
    return [ClimateReading.of_series(*one) for one in zip(*columns, strict=True)]
