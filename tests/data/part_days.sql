BEGIN TRANSACTION;
CREATE TABLE accounts (
	account_id TEXT NOT NULL, 
	name TEXT NOT NULL, 
	name_key TEXT NOT NULL, 
	role TEXT NOT NULL, 
	password TEXT NOT NULL, 
	disabled BOOLEAN NOT NULL, 
	ends_at DOUBLE, 
	invitation TEXT NOT NULL, 
	invited_until DOUBLE NOT NULL, 
	since DOUBLE NOT NULL, provider TEXT DEFAULT '' NOT NULL, language TEXT DEFAULT '' NOT NULL, pin TEXT DEFAULT '' NOT NULL, 
	CONSTRAINT pk_accounts PRIMARY KEY (account_id), 
	CONSTRAINT uq_accounts_name_key UNIQUE (name_key)
);
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO "alembic_version" VALUES('part_days');
CREATE TABLE "alerts" (
	alert_id TEXT NOT NULL, 
	priority TEXT NOT NULL, 
	"key" TEXT NOT NULL, 
	raised_at DOUBLE NOT NULL, 
	slots TEXT NOT NULL, 
	robot_id TEXT, 
	cleared_at DOUBLE, 
	acknowledged_at DOUBLE, 
	acknowledged_by TEXT, 
	note TEXT, 
	count INTEGER NOT NULL, 
	revision BIGINT NOT NULL, 
	last_raised_at DOUBLE NOT NULL, 
	members TEXT NOT NULL, 
	CONSTRAINT pk_alerts PRIMARY KEY (alert_id)
);
INSERT INTO "alerts" VALUES('A1','P2','alert.person_slowed',1700000000.0,'{"robot":"AGI"}','AGI',1700000003.0,NULL,NULL,NULL,1,7,1700000000.0,'[]');
INSERT INTO "alerts" VALUES('A2','P2','alert.person_slowed',1700000009.0,'{"robot":"AGI"}','AGI',NULL,NULL,NULL,NULL,1,8,1700000009.0,'[]');
CREATE TABLE api_tokens (
	token_id TEXT NOT NULL, 
	name TEXT NOT NULL, 
	name_key TEXT NOT NULL, 
	scope TEXT NOT NULL, 
	digest TEXT NOT NULL, 
	made_at DOUBLE NOT NULL, 
	used_at DOUBLE, ends_at DOUBLE, 
	CONSTRAINT pk_api_tokens PRIMARY KEY (token_id), 
	CONSTRAINT uq_api_tokens_name_key UNIQUE (name_key)
);
CREATE TABLE audit (
	seq INTEGER NOT NULL, 
	audit_id TEXT NOT NULL, 
	at DOUBLE NOT NULL, 
	stored_at DOUBLE NOT NULL, 
	person TEXT NOT NULL, 
	name TEXT NOT NULL, 
	role TEXT NOT NULL, 
	method TEXT NOT NULL, 
	action TEXT NOT NULL, 
	subject TEXT NOT NULL, 
	details TEXT NOT NULL, 
	previous_hash TEXT NOT NULL, 
	hash TEXT NOT NULL, 
	CONSTRAINT pk_audit PRIMARY KEY (seq), 
	CONSTRAINT uq_audit_audit_id UNIQUE (audit_id)
);
INSERT INTO "audit" VALUES(1,'U1',1700000001.0,1.79588777118182921404e+09,'P1','Ana Núñez','operator','link','stop','AGI','{"status":202}','0000000000000000000000000000000000000000000000000000000000000000','e90fa767a371ad0482f567d0c8f6eac4986857c4489bb3f0bffd78ea026d89ae');
INSERT INTO "audit" VALUES(2,'U2',1700000002.0,1.79588777118182921404e+09,'P1','Ana Núñez','operator','link','release','AGI','{"status":202}','e90fa767a371ad0482f567d0c8f6eac4986857c4489bb3f0bffd78ea026d89ae','1be54372de55feedc265e210f14733554d3e0bdc1c7053a40fd34bc4616f43b8');
INSERT INTO "audit" VALUES(3,'U3',1700000003.0,1.79588777118182921404e+09,'P1','Ana Núñez','operator','link','rule','AGI','{"status":202}','1be54372de55feedc265e210f14733554d3e0bdc1c7053a40fd34bc4616f43b8','00e3977c4450c09ad0dbe4821dd486b2342b3cb162d543be05e95701ed21e28f');
CREATE TABLE audit_end (
	one INTEGER NOT NULL, 
	seq BIGINT NOT NULL, 
	hash TEXT NOT NULL, 
	at DOUBLE NOT NULL, 
	CONSTRAINT pk_audit_end PRIMARY KEY (one)
);
INSERT INTO "audit_end" VALUES(1,3,'00e3977c4450c09ad0dbe4821dd486b2342b3cb162d543be05e95701ed21e28f',1.79588777118182921404e+09);
CREATE TABLE audit_sealed (
	seq INTEGER NOT NULL, 
	hash TEXT NOT NULL, 
	at DOUBLE NOT NULL, 
	CONSTRAINT pk_audit_sealed PRIMARY KEY (seq)
);
CREATE TABLE climate (
	row_id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at DOUBLE NOT NULL, 
	temperature DOUBLE, 
	relative_humidity DOUBLE, 
	co2 DOUBLE
);
INSERT INTO "climate" VALUES(1,1700000000.0,21.5,0.7,430.0);
CREATE TABLE command_events (
	row_id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	command_id TEXT NOT NULL, 
	robot_id TEXT NOT NULL, 
	at DOUBLE NOT NULL, 
	state TEXT NOT NULL, 
	why TEXT NOT NULL, 
	CONSTRAINT uq_command_events_command_id_at_state_why UNIQUE (command_id, at, state, why)
);
INSERT INTO "command_events" VALUES(1,'C1','AGI',1700000001.0,'REQUESTED','requested');
INSERT INTO "command_events" VALUES(2,'C1','AGI',1700000001.4,'STANDING','standing');
CREATE TABLE "commands" (
	command_id TEXT NOT NULL, 
	robot_id TEXT NOT NULL, 
	kind TEXT NOT NULL, 
	state TEXT NOT NULL, 
	requested_by TEXT NOT NULL, 
	requested_at DOUBLE NOT NULL, 
	standing_at DOUBLE, 
	standstill_ms DOUBLE, 
	tries INTEGER NOT NULL, 
	reason TEXT, 
	revision BIGINT NOT NULL, 
	pressed_at DOUBLE, 
	drill BOOLEAN DEFAULT 0 NOT NULL, 
	sent_at TEXT NOT NULL, 
	answer_at TEXT NOT NULL, goal TEXT, 
	CONSTRAINT pk_commands PRIMARY KEY (command_id)
);
INSERT INTO "commands" VALUES('C1','AGI','stop','STANDING','ana',1700000001.0,1700000001.4,400.0,0,NULL,3,NULL,0,'{}','{}','null');
INSERT INTO "commands" VALUES('C2','AGI','stop','RUNNING','ana',1700000002.0,NULL,NULL,0,NULL,4,NULL,1,'{}','{}','null');
CREATE TABLE decisions (
	decision_id TEXT NOT NULL, 
	kind TEXT NOT NULL, 
	robot_id TEXT NOT NULL, 
	started_at DOUBLE NOT NULL, 
	person_id TEXT, 
	observer TEXT, 
	class TEXT, 
	class_id TEXT, 
	confidence DOUBLE, 
	x DOUBLE, 
	y DOUBLE, 
	z DOUBLE, 
	distance_m DOUBLE, 
	speed_factor DOUBLE, 
	reason TEXT, 
	rule_id TEXT, 
	rule_version TEXT, 
	rule_parameters TEXT NOT NULL, 
	in_sight BOOLEAN, 
	feedback_at DOUBLE, 
	applied_at DOUBLE, 
	observed_at DOUBLE, 
	ended_at DOUBLE, 
	speed_before DOUBLE, 
	speed_after DOUBLE, 
	links TEXT NOT NULL, 
	revision BIGINT NOT NULL, 
	CONSTRAINT pk_decisions PRIMARY KEY (decision_id)
);
INSERT INTO "decisions" VALUES('D1','mandate','AGII',1700000000.0,'P1','AGI','person','farmer',0.94,1.0,2.0,0.9,1.43,0.5,'person','ring','1','{"radius_m":2.0}',0,NULL,NULL,NULL,1700000005.0,NULL,NULL,'[{"link":"detection","at":1700000000.0,"value":"farmer","verdict":"ok"}]',1);
INSERT INTO "decisions" VALUES('D2','mandate','AGII',1700000060.0,'P1','AGI','person','farmer',0.94,1.0,2.0,0.9,1.43,0.5,'person','ring','1','{"radius_m":2.0}',0,NULL,NULL,NULL,NULL,NULL,NULL,'[{"link":"detection","at":1700000000.0,"value":"farmer","verdict":"ok"}]',2);
CREATE TABLE "detections" (
	row_id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at DOUBLE NOT NULL, 
	robot_id TEXT NOT NULL, 
	class_id TEXT NOT NULL, 
	probability DOUBLE NOT NULL, 
	x DOUBLE, 
	y DOUBLE, 
	z DOUBLE, 
	confident BOOLEAN NOT NULL, 
	transport TEXT NOT NULL, 
	stamp TEXT, 
	class TEXT, 
	person_id TEXT, 
	box TEXT
, late BOOLEAN DEFAULT 0 NOT NULL);
INSERT INTO "detections" VALUES(1,1700000000.0,'AGI','farmer',0.94,-3.5,2.0,0.9,1,'direct','2023-11-14T22:13:19.900Z','person',NULL,'{"xmin":-4.0,"xmax":-3.0,"ymin":1.5,"ymax":2.5,"zmin":0.0,"zmax":1.8,"frame_id":"map"}',0);
CREATE TABLE latency (
	row_id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at DOUBLE NOT NULL, 
	robot_id TEXT NOT NULL, 
	data TEXT NOT NULL, 
	hop TEXT NOT NULL, 
	count BIGINT NOT NULL, 
	total_s DOUBLE NOT NULL, 
	least_s DOUBLE NOT NULL, 
	most_s DOUBLE NOT NULL, 
	bins TEXT NOT NULL
);
CREATE TABLE log (
	row_id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	id BIGINT NOT NULL, 
	at DOUBLE NOT NULL, 
	kind TEXT NOT NULL, 
	"key" TEXT NOT NULL, 
	slots TEXT NOT NULL, 
	robot_id TEXT, 
	class TEXT, 
	decision_id TEXT, 
	CONSTRAINT uq_log_id_at UNIQUE (id, at)
);
INSERT INTO "log" VALUES(1,1,1700000000.0,'speed','log.speed_up','{"robot":"AGI"}','AGI',NULL,NULL);
CREATE TABLE measurements (
	row_id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at DOUBLE NOT NULL, 
	entity_id TEXT NOT NULL, 
	attribute TEXT NOT NULL, 
	value DOUBLE NOT NULL, 
	unit TEXT NOT NULL
);
INSERT INTO "measurements" VALUES(1,1700000000.0,'unit','flow',18.5,'L/min');
INSERT INTO "measurements" VALUES(2,1700000060.0,'unit','flow',18.5,'L/min');
CREATE TABLE odometry (
	row_id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at DOUBLE NOT NULL, 
	robot_id TEXT NOT NULL, 
	x DOUBLE NOT NULL, 
	y DOUBLE NOT NULL, 
	yaw DOUBLE NOT NULL, 
	linear DOUBLE NOT NULL, 
	angular DOUBLE NOT NULL, 
	limit_factor DOUBLE NOT NULL, 
	applied_factor DOUBLE, 
	link TEXT
, margin_m DOUBLE, late BOOLEAN DEFAULT 0 NOT NULL);
INSERT INTO "odometry" VALUES(1,1700000000.0,'AGI',1.0,2.0,0.5,0.5,0.0,1.0,1.0,'LIVE',NULL,0);
INSERT INTO "odometry" VALUES(2,1700000000.5,'AGI',1.0,2.0,0.5,0.5,0.0,1.0,1.0,'LIVE',NULL,0);
CREATE TABLE passkeys (
	credential_id TEXT NOT NULL, 
	account_id TEXT NOT NULL, 
	name TEXT NOT NULL, 
	rp_id TEXT NOT NULL, 
	public_key TEXT NOT NULL, 
	sign_count BIGINT NOT NULL, 
	made_at DOUBLE NOT NULL, 
	used_at DOUBLE, 
	CONSTRAINT pk_passkeys PRIMARY KEY (credential_id)
);
CREATE TABLE readings (
	row_id INTEGER NOT NULL PRIMARY KEY AUTOINCREMENT, 
	at DOUBLE NOT NULL, 
	robot_id TEXT NOT NULL, 
	kind TEXT NOT NULL, 
	value TEXT NOT NULL
);
CREATE INDEX ix_command_events_robot_id_at ON command_events (robot_id, at);
CREATE INDEX ix_decisions_robot_id_started_at ON decisions (robot_id, started_at);
CREATE INDEX ix_decisions_started_at_decision_id ON decisions (started_at, decision_id);
CREATE INDEX ix_log_at_row_id ON log (at, row_id);
CREATE INDEX ix_log_robot_id_at ON log (robot_id, at);
CREATE INDEX ix_odometry_at ON odometry (at);
CREATE INDEX ix_odometry_robot_id_at ON odometry (robot_id, at);
CREATE INDEX ix_climate_at ON climate (at);
CREATE INDEX ix_alerts_robot_id_raised_at ON alerts (robot_id, raised_at);
CREATE INDEX ix_alerts_last_raised_at_alert_id ON alerts (last_raised_at, alert_id);
CREATE INDEX ix_latency_at ON latency (at);
CREATE INDEX ix_readings_at_row_id ON readings (at, row_id);
CREATE INDEX ix_readings_robot_id_at ON readings (robot_id, at);
CREATE INDEX ix_commands_robot_id_requested_at ON commands (robot_id, requested_at);
CREATE INDEX ix_commands_requested_at_command_id ON commands (requested_at, command_id);
CREATE INDEX ix_detections_robot_id_at ON detections (robot_id, at);
CREATE INDEX ix_detections_at_row_id ON detections (at, row_id);
CREATE INDEX ix_command_events_at ON command_events (at);
CREATE INDEX ix_detections_placed ON detections (at) WHERE x IS NOT NULL;
CREATE INDEX ix_decisions_placed ON decisions (started_at) WHERE x IS NOT NULL;
CREATE INDEX ix_log_placed ON log (at) WHERE instr(slots, '"x":') > 0;
CREATE INDEX ix_measurements_at_row_id ON measurements (at, row_id);
CREATE INDEX ix_measurements_entity_id_attribute_at ON measurements (entity_id, attribute, at);
CREATE INDEX ix_audit_at_seq ON audit (at, seq);
CREATE TRIGGER audit_no_update BEFORE UPDATE ON audit  BEGIN SELECT RAISE(ABORT, 'the audit is append-only'); END;
CREATE TRIGGER audit_no_delete BEFORE DELETE ON audit WHEN OLD.seq > coalesce((SELECT max(seq) FROM audit_sealed), 0) BEGIN SELECT RAISE(ABORT, 'the audit is append-only'); END;
CREATE TRIGGER audit_sealed_no_update BEFORE UPDATE ON audit_sealed  BEGIN SELECT RAISE(ABORT, 'the audit is append-only'); END;
CREATE TRIGGER audit_sealed_no_delete BEFORE DELETE ON audit_sealed  BEGIN SELECT RAISE(ABORT, 'the audit is append-only'); END;
CREATE INDEX ix_odometry_slowed ON odometry (at, robot_id, x, y, linear, applied_factor) WHERE applied_factor > 0.0 AND applied_factor < 1.0 AND (linear >= 0.02 OR linear <= -0.02);
CREATE INDEX ix_odometry_near ON odometry (at, robot_id, x, y, linear, margin_m) WHERE margin_m < 0.0;
COMMIT;
