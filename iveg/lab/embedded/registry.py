"""Groups and devices in memory, in the order that MongoDB's index would give."""

from collections.abc import Mapping

from iveg.lab.embedded.devices import AgentDevice, Group, Tenancy
from iveg.lab.embedded.errors import FiwareError, no_device


class Registry:
    """The groups and devices of every tenant."""

    def __init__(self) -> None:
        self._groups: dict[tuple[Tenancy, str, str], Group] = {}
        self._devices: dict[tuple[Tenancy, str, str], AgentDevice] = {}
        self._by_topic: dict[tuple[str, str], AgentDevice] = {}

    # --- groups -----------------------------------------------------------------

    def groups(self, tenancy: Tenancy) -> list[Group]:
        """The groups of a tenancy."""
        return [one for one in self._groups.values() if one.tenancy == tenancy]

    def add_group(self, group: Group) -> None:
        """Keep a group.

        Raises:
            FiwareError: 409, the API key and resource are in use.
        """
        key = (group.tenancy, group.resource, group.apikey)
        if key in self._groups:
            raise FiwareError(
                "DUPLICATE_GROUP",
                "A device configuration already exists for resource "
                f"{group.resource} and API Key {group.apikey}",
            )
        self._groups[key] = group

    def change_group(
        self, tenancy: Tenancy, resource: str, apikey: str, raw: Mapping[str, object]
    ) -> None:
        """Change a group.

        Raises:
            FiwareError: 400 or 404.
        """
        group = self._group(tenancy, resource, apikey)
        self._groups[tenancy, resource, apikey] = group.changed(raw)

    def remove_group(self, tenancy: Tenancy, resource: str, apikey: str) -> None:
        """Forget a group; its devices stay.

        Raises:
            FiwareError: 404.
        """
        self._group(tenancy, resource, apikey)
        del self._groups[tenancy, resource, apikey]

    def _group(self, tenancy: Tenancy, resource: str, apikey: str) -> Group:
        found = self._groups.get((tenancy, resource, apikey))
        if found is None:
            raise FiwareError(
                "DEVICE_GROUP_NOT_FOUND",
                "Couldn\t find device group for fields: "
                '["resource","apikey"] and values: '
                f'{{"resource":"{resource}","apikey":"{apikey}"}}',
            )
        return found

    def group_of(self, apikey: str) -> Group | None:
        """The group of an API key, in any tenant."""
        return next(
            (one for one in self._groups.values() if one.apikey == apikey), None
        )

    def group_in(self, tenancy: Tenancy, apikey: object) -> Group | None:
        """A group of a tenant: that of the API key, else the first one."""
        found = self.groups(tenancy)
        return next((one for one in found if not apikey or apikey == one.apikey), None)

    # --- devices ----------------------------------------------------------------

    def devices(self, tenancy: Tenancy) -> list[AgentDevice]:
        """The devices of a tenancy, oldest first."""
        return [one for one in self._devices.values() if one.tenancy == tenancy]

    def device(self, tenancy: Tenancy, device_id: str) -> AgentDevice:
        """One device of a tenancy.

        Raises:
            FiwareError: 404.
        """
        for one in self.devices(tenancy):
            if one.device_id == device_id:
                return one
        raise no_device(device_id)

    def is_known(self, device: AgentDevice) -> bool:
        """Whether a device with this id, API key and tenant is stored."""
        return (device.tenancy, device.apikey, device.device_id) in self._devices

    def put(self, device: AgentDevice) -> None:
        """Store a device; it replaces an older one with the same key."""
        self._devices[device.tenancy, device.apikey, device.device_id] = device
        self._by_topic[device.apikey, device.device_id] = device

    def remove(self, device: AgentDevice) -> None:
        """Delete a device."""
        del self._devices[device.tenancy, device.apikey, device.device_id]
        self._by_topic.pop((device.apikey, device.device_id), None)

    def device_of(self, apikey: str, device_id: str) -> AgentDevice | None:
        """The device of a topic."""
        return self._by_topic.get((apikey, device_id))

    def device_for(self, tenancy: Tenancy, name: str, kind: str) -> AgentDevice:
        """The device that commands for an entity are sent to.

        Several may share the entity; MongoDB answers in the order of its index, so it
        is the one whose API key and id sort first, with the command or without.

        Raises:
            FiwareError: 404.
        """
        found = [
            one
            for one in self.devices(tenancy)
            if (one.entity_name, one.entity_type) == (name, kind)
        ]
        if not found:
            raise no_device(name)
        return min(found, key=lambda one: (one.apikey, one.device_id))
