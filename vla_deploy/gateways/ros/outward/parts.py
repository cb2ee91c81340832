"""List what the gateway tells the graph."""

from vla_deploy.gateways.ros.outward.body import Body
from vla_deploy.gateways.ros.outward.sensors import Images, Inertia, Scans
from vla_deploy.gateways.ros.part import Gateway, GatewayPart


def outward_parts(gateway: Gateway) -> tuple[GatewayPart, ...]:
    """Return the parts that tell."""
    return (Body(gateway), Scans(gateway), Inertia(gateway), Images(gateway))
