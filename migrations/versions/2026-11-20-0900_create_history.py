"""Create the history: decisions, detections, commands, alerts, log, odometry."""

import sqlalchemy as sa
from alembic import op

revision = "create_history"
down_revision = None
branch_labels = None
depends_on = None

_BIG = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "alerts",
        sa.Column("alert_id", sa.Text(), nullable=False),
        sa.Column("priority", sa.Text(), nullable=False),
        sa.Column("key", sa.Text(), nullable=False),
        sa.Column("raised_at", sa.Double(), nullable=False),
        sa.Column("slots", sa.Text(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=True),
        sa.Column("cleared_at", sa.Double(), nullable=True),
        sa.Column("acknowledged_at", sa.Double(), nullable=True),
        sa.Column("acknowledged_by", sa.Text(), nullable=True),
        sa.Column("note", sa.Text(), nullable=True),
        sa.Column("count", sa.Integer(), nullable=False),
        sa.Column("revision", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("alert_id", name="pk_alerts"),
    )
    op.create_index("ix_alerts_raised_at_alert_id", "alerts", ["raised_at", "alert_id"])
    op.create_index("ix_alerts_robot_id_raised_at", "alerts", ["robot_id", "raised_at"])

    op.create_table(
        "command_events",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("command_id", sa.Text(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("why", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("row_id", name="pk_command_events"),
        sa.UniqueConstraint(
            "command_id",
            "at",
            "state",
            "why",
            name="uq_command_events_command_id_at_state_why",
        ),
        sqlite_autoincrement=True,
    )
    op.create_index(
        "ix_command_events_robot_id_at", "command_events", ["robot_id", "at"]
    )

    op.create_table(
        "commands",
        sa.Column("command_id", sa.Text(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("state", sa.Text(), nullable=False),
        sa.Column("requested_by", sa.Text(), nullable=False),
        sa.Column("requested_at", sa.Double(), nullable=False),
        sa.Column("sent_fiware_at", sa.Double(), nullable=True),
        sa.Column("sent_direct_at", sa.Double(), nullable=True),
        sa.Column("answer_fiware_at", sa.Double(), nullable=True),
        sa.Column("answer_direct_at", sa.Double(), nullable=True),
        sa.Column("standing_at", sa.Double(), nullable=True),
        sa.Column("standstill_ms", sa.Double(), nullable=True),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("revision", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("command_id", name="pk_commands"),
    )
    op.create_index(
        "ix_commands_requested_at_command_id",
        "commands",
        ["requested_at", "command_id"],
    )
    op.create_index(
        "ix_commands_robot_id_requested_at", "commands", ["robot_id", "requested_at"]
    )

    op.create_table(
        "decisions",
        sa.Column("decision_id", sa.Text(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=False),
        sa.Column("started_at", sa.Double(), nullable=False),
        sa.Column("person_id", sa.Text(), nullable=True),
        sa.Column("observer", sa.Text(), nullable=True),
        sa.Column("class", sa.Text(), nullable=True),
        sa.Column("class_id", sa.Text(), nullable=True),
        sa.Column("confidence", sa.Double(), nullable=True),
        sa.Column("x", sa.Double(), nullable=True),
        sa.Column("y", sa.Double(), nullable=True),
        sa.Column("z", sa.Double(), nullable=True),
        sa.Column("distance_m", sa.Double(), nullable=True),
        sa.Column("speed_factor", sa.Double(), nullable=True),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("rule_id", sa.Text(), nullable=True),
        sa.Column("rule_version", sa.Text(), nullable=True),
        sa.Column("rule_parameters", sa.Text(), nullable=False),
        sa.Column("in_sight", sa.Boolean(), nullable=True),
        sa.Column("feedback_at", sa.Double(), nullable=True),
        sa.Column("applied_at", sa.Double(), nullable=True),
        sa.Column("observed_at", sa.Double(), nullable=True),
        sa.Column("ended_at", sa.Double(), nullable=True),
        sa.Column("speed_before", sa.Double(), nullable=True),
        sa.Column("speed_after", sa.Double(), nullable=True),
        sa.Column("links", sa.Text(), nullable=False),
        sa.Column("revision", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("decision_id", name="pk_decisions"),
    )
    op.create_index(
        "ix_decisions_robot_id_started_at", "decisions", ["robot_id", "started_at"]
    )
    op.create_index(
        "ix_decisions_started_at_decision_id",
        "decisions",
        ["started_at", "decision_id"],
    )

    op.create_table(
        "detections",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=False),
        sa.Column("class_id", sa.Text(), nullable=False),
        sa.Column("probability", sa.Double(), nullable=False),
        sa.Column("x", sa.Double(), nullable=False),
        sa.Column("y", sa.Double(), nullable=False),
        sa.Column("z", sa.Double(), nullable=False),
        sa.Column("confident", sa.Boolean(), nullable=False),
        sa.Column("road", sa.Text(), nullable=False),
        sa.Column("stamp", sa.Text(), nullable=True),
        sa.Column("class", sa.Text(), nullable=True),
        sa.Column("person_id", sa.Text(), nullable=True),
        sa.Column("box", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("row_id", name="pk_detections"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_detections_at_row_id", "detections", ["at", "row_id"])
    op.create_index("ix_detections_robot_id_at", "detections", ["robot_id", "at"])

    op.create_table(
        "log",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("id", sa.BigInteger(), nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("kind", sa.Text(), nullable=False),
        sa.Column("key", sa.Text(), nullable=False),
        sa.Column("slots", sa.Text(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=True),
        sa.Column("class", sa.Text(), nullable=True),
        sa.Column("decision_id", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("row_id", name="pk_log"),
        sa.UniqueConstraint("id", "at", name="uq_log_id_at"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_log_at_row_id", "log", ["at", "row_id"])
    op.create_index("ix_log_robot_id_at", "log", ["robot_id", "at"])

    op.create_table(
        "odometry",
        sa.Column("row_id", _BIG, autoincrement=True, nullable=False),
        sa.Column("at", sa.Double(), nullable=False),
        sa.Column("robot_id", sa.Text(), nullable=False),
        sa.Column("x", sa.Double(), nullable=False),
        sa.Column("y", sa.Double(), nullable=False),
        sa.Column("yaw", sa.Double(), nullable=False),
        sa.Column("linear", sa.Double(), nullable=False),
        sa.Column("angular", sa.Double(), nullable=False),
        sa.Column("mandated_factor", sa.Double(), nullable=False),
        sa.Column("applied_factor", sa.Double(), nullable=True),
        sa.Column("link", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("row_id", name="pk_odometry"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_odometry_at", "odometry", ["at"])
    op.create_index("ix_odometry_robot_id_at", "odometry", ["robot_id", "at"])


def downgrade() -> None:
    op.drop_table("odometry")
    op.drop_table("log")
    op.drop_table("detections")
    op.drop_table("decisions")
    op.drop_table("commands")
    op.drop_table("command_events")
    op.drop_table("alerts")
