// SPDX-License-Identifier: Apache-2.0
// node write_recordings.mjs ASL_FOLDER OUT_FOLDER: the recording in MCAP and rosbag2 files, written by libraries that
// have nothing to do with takt. Compression is that of the programs lz4 and zstd.
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import { open } from "node:fs/promises";
import path from "node:path";
import { McapWriter } from "@mcap/core";
import { FileHandleWritable } from "@mcap/nodejs";
import { MessageWriter as Ros1Writer } from "@foxglove/rosmsg-serialization";
import { MessageWriter as Ros2Writer } from "@foxglove/rosmsg2-serialization";
import { parse } from "@foxglove/rosmsg";
import definitions from "@foxglove/rosmsg-msgs-common";
import initSqlJs from "sql.js";
import { readAsl, recordedAt, stampOf } from "./recording.mjs";

const [asl, out] = process.argv.slice(2);
const messages = readAsl(asl);

/// A type's definition with all that it is made of.
function withParts(set, type) {
  const list = [];
  const add = (name) => {
    const found = set[name];
    if (!found || list.some((d) => d.name === name)) return;
    list.push({ name, definitions: found.definitions });
    for (const field of found.definitions) if (field.isComplex) add(field.type);
  };
  add(type);
  return list;
}

const headerText = "std_msgs/Header header\n";

const encoders = {
  cdr: {
    schemaEncoding: "ros2msg",
    name: (type) => type.replace("/", "/msg/"),
    text: headerText,
    encode: (() => {
      const writers = new Map();
      return ({ type, ns, message }) => {
        if (!writers.has(type)) writers.set(type, new Ros2Writer(withParts(definitions.ros2humble, type)));
        const header = { stamp: stampOf(ns), frame_id: "body" };
        return writers.get(type).writeMessage({ header, ...message });
      };
    })(),
  },
  ros1: {
    schemaEncoding: "ros1msg",
    name: (type) => type,
    text: "Header header\n",
    encode: (() => {
      const writers = new Map();
      let seq = 0;
      return ({ type, ns, message }) => {
        if (!writers.has(type)) writers.set(type, new Ros1Writer(withParts(definitions.ros1, type)));
        return writers.get(type).writeMessage({ header: { seq: seq++, stamp: stampOf(ns), frame_id: "body" }, ...message });
      };
    })(),
  },
  json: {
    schemaEncoding: "jsonschema",
    name: (type) => type,
    text: "{}",
    encode: ({ ns, message }) => {
      const { sec, nsec } = stampOf(ns);
      const plain = { header: { stamp: { sec, nanosec: nsec }, frame_id: "body" }, ...message };
      if (plain.data) plain.data = Buffer.from(plain.data).toString("base64");
      return new TextEncoder().encode(JSON.stringify(plain));
    },
  },
};

async function writeMcap(name, encoding, options = {}) {
  const handle = await open(path.join(out, name), "w");
  const writer = new McapWriter({ writable: new FileHandleWritable(handle), chunkSize: 512 * 1024, ...options });
  await writer.start({ profile: encoding === "cdr" ? "ros2" : "", library: "an independent writer" });
  await writer.addMetadata({ name: "rig", metadata: new Map([["serial", "17"]]) });
  const { schemaEncoding, name: nameOf, text, encode } = encoders[encoding];
  const channels = new Map();
  let index = 0;
  for (const m of messages) {
    if (!channels.has(m.topic)) {
      const schemaId = await writer.registerSchema({
        name: nameOf(m.type), encoding: schemaEncoding, data: new TextEncoder().encode(text),
      });
      const id = await writer.registerChannel({ schemaId, topic: m.topic, messageEncoding: encoding, metadata: new Map() });
      channels.set(m.topic, id);
    }
    const logTime = recordedAt(m.ns, index);
    await writer.addMessage({
      channelId: channels.get(m.topic), sequence: index++, logTime, publishTime: logTime, data: encode(m),
    });
  }
  await writer.addAttachment({ name: "note.txt", logTime: 1n, createTime: 2n, mediaType: "text/plain", data: new Uint8Array([1, 2, 3]) });
  await writer.end();
  await handle.close();
}

const piped = (program, extra) => (data) => ({
  compression: program,
  compressedData: new Uint8Array(execFileSync(program, ["-q", "-c", ...extra], { input: data, maxBuffer: 1 << 28 })),
});

const topicsSql =
  "CREATE TABLE topics(id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL,offered_qos_profiles TEXT NOT NULL";
async function writeDb3(name, { schema, compressed }) {
  const SQL = await initSqlJs();
  const db = new SQL.Database();
  db.run(topicsSql + (schema === "new" ? ",type_description_hash TEXT NOT NULL)" : ")"));
  db.run("CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL,data BLOB NOT NULL)");
  if (schema === "new") {
    db.run("CREATE TABLE schema(schema_version INTEGER PRIMARY KEY,ros_distro TEXT NOT NULL)");
    db.run("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY,topic_type TEXT NOT NULL,encoding TEXT NOT NULL,encoded_message_definition TEXT NOT NULL,type_description_hash TEXT NOT NULL)");
  }
  const ids = new Map();
  const compress = piped("zstd", []);
  const insert = db.prepare("INSERT INTO messages(topic_id,timestamp,data) VALUES(?,?,?)");
  let index = 0;
  for (const m of messages) {
    const type = encoders.cdr.name(m.type);
    if (!ids.has(m.topic)) {
      ids.set(m.topic, ids.size + 1);
      const hash = schema === "new" ? [""] : [];
      db.run(`INSERT INTO topics VALUES(?,?,?,'cdr',''${schema === "new" ? ",?" : ""})`, [ids.get(m.topic), m.topic, type, ...hash]);
      if (schema === "new") db.run("INSERT INTO message_definitions(topic_type,encoding,encoded_message_definition,type_description_hash) VALUES(?,'ros2msg',?,'')", [type, headerText]);
    }
    let data = encoders.cdr.encode(m);
    if (compressed) data = compress(data).compressedData;
    // Whole numbers beyond 2^53 go in as text and are stored as integers.
    insert.run([ids.get(m.topic), recordedAt(m.ns, index++).toString(), data]);
  }
  insert.free();
  fs.writeFileSync(path.join(out, name), db.export());
}

fs.mkdirSync(out, { recursive: true });
await writeMcap("cdr.mcap", "cdr");
await writeMcap("cdr_lz4.mcap", "cdr", { compressChunk: piped("lz4", []) });
await writeMcap("cdr_zstd.mcap", "cdr", { compressChunk: piped("zstd", []) });
await writeMcap("unindexed.mcap", "cdr", { useChunks: false, useStatistics: false, useSummaryOffsets: false, repeatSchemas: false, repeatChannels: false });
await writeMcap("ros1.mcap", "ros1", { compressChunk: piped("lz4", []) });
await writeMcap("json.mcap", "json", { compressChunk: piped("zstd", []) });
await writeDb3("old.db3", { schema: "old" });
await writeDb3("new.db3", { schema: "new" });
if (process.env.TAKT_INTEROP_ALL) await writeDb3("messages_zstd.db3", { schema: "new", compressed: true });
execFileSync("zstd", ["-q", "-f", path.join(out, "new.db3"), "-o", path.join(out, "file.db3.zstd")]);
