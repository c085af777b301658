"""Subscriptions and registrations at Orion."""

from iveg.adapters.fiware_http import Document, FiwareClient
from iveg.domain.errors import HopError


class OrionSubscriptions(FiwareClient):
    """Subscriptions and registrations of one tenant."""

    async def read_registrations(self) -> list[Document]:
        """Every registration of our tenant.

        Raises:
            HopError: Orion does not answer.
        """
        return await self.http.read_all("/v2/registrations")

    async def delete_registration(self, registration_id: str) -> None:
        """Delete a registration; one that is gone already is no error.

        Raises:
            HopError: Orion does not answer.
        """
        path = f"/v2/registrations/{registration_id}"
        await self.http.ask("DELETE", path, also=(404,))

    async def read_subscriptions(self) -> list[Document]:
        """Every subscription of our tenant.

        Raises:
            HopError: Orion does not answer.
        """
        return await self.http.read_all("/v2/subscriptions")

    async def create_subscription(self, document: Document) -> str:
        """Subscribe; the id of the subscription.

        Raises:
            HopError: Orion does not take it.
        """
        response = await self.http.ask("POST", "/v2/subscriptions", body=dict(document))
        made = str(response.headers.get("Location", "").rpartition("/")[2])
        if not made:
            raise HopError("orion", "took a subscription and did not say where it is")
        return made

    async def update_subscription(
        self, subscription_id: str, changes: Document
    ) -> None:
        """Change a subscription; each part that is named replaces the old one whole.

        Raises:
            HopError: Orion does not take it.
        """
        path = f"/v2/subscriptions/{subscription_id}"
        await self.http.ask("PATCH", path, body=dict(changes))

    async def delete_subscription(self, subscription_id: str) -> None:
        """Delete a subscription; one that is gone already is no error.

        Raises:
            HopError: Orion does not answer.
        """
        path = f"/v2/subscriptions/{subscription_id}"
        await self.http.ask("DELETE", path, also=(404,))
