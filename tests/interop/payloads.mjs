// SPDX-License-Identifier: Apache-2.0
// node payloads.mjs FILE...: what independent readers find in MCAP, rosbag2 and ROS 1 files, as JSON: for each topic
// the count, the stamps' extremes, and a hash of all payloads and record times with the stamps left out.
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import fs from "node:fs";
import { open } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
import initSqlJs from "sql.js";

function unpack(program) {
  return (data) => new Uint8Array(execFileSync(program, ["-d", "-q", "-c"], { input: data, maxBuffer: 1 << 29 }));
}
const decompressHandlers = { lz4: unpack("lz4"), zstd: unpack("zstd") };

class Digest {
  topics = {};
  add(topic, encoding, time, data) {
    const t = (this.topics[topic] ??= { count: 0, first: null, last: null, hash: createHash("sha256") });
    const bytes = Buffer.from(data);
    let ns;
    if (encoding === "json") {
      const message = JSON.parse(bytes.toString("utf8"));
      const { sec, nanosec } = message.header.stamp;
      ns = BigInt(sec) * 1000000000n + BigInt(nanosec);
      message.header.stamp = null;
      t.hash.update(JSON.stringify(message));
    } else {
      const at = 4; // behind CDR's first bytes, or behind ROS 1's sequence number
      ns = BigInt(bytes.readUInt32LE(at)) * 1000000000n + BigInt(bytes.readUInt32LE(at + 4));
      bytes.fill(0, at, at + 8);
      t.hash.update(bytes);
    }
    t.hash.update(String(time));
    t.count++;
    if (t.first === null || ns < t.first) t.first = ns;
    if (t.last === null || ns > t.last) t.last = ns;
  }
  done() {
    const out = {};
    for (const [topic, t] of Object.entries(this.topics).sort())
      out[topic] = { count: t.count, first_ns: String(t.first), last_ns: String(t.last), sha256: t.hash.digest("hex") };
    return out;
  }
}

async function mcap(file) {
  const digest = new Digest();
  const handle = await open(file, "r");
  const channels = new Map();
  let indexed = null;
  try {
    indexed = await McapIndexedReader.Initialize({ readable: new FileHandleReadable(handle), decompressHandlers });
  } catch {
    indexed = null; // no summary
  }
  if (indexed && indexed.chunkIndexes.length > 0) {
    // The index, its places and times, and every checksum are looked at by this reader.
    for await (const m of indexed.readMessages({ validateCrcs: true })) {
      const channel = indexed.channelsById.get(m.channelId);
      digest.add(channel.topic, channel.messageEncoding, m.logTime, m.data);
    }
    for await (const a of indexed.readAttachments()) if (a.data.byteLength !== 3) throw new Error("attachment");
    for await (const m of indexed.readMetadata()) if (m.metadata.get("serial") !== "17") throw new Error("metadata");
  }
  // All of the file in its order, with the checksums of the data section.
  const linear = new Digest();
  const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(new Uint8Array(fs.readFileSync(file)));
  for (let record; (record = stream.nextRecord()); ) {
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId);
    linear.add(channel.topic, channel.messageEncoding, record.logTime, record.data);
  }
  if (!stream.done()) throw new Error(file + " does not end as it should");
  await handle.close();
  const result = linear.done();
  if (indexed && indexed.chunkIndexes.length > 0) {
    const other = digest.done();
    for (const topic of Object.keys(result))
      if (other[topic]?.count !== result[topic].count) throw new Error(`${file}: ${topic}: the index and the file disagree`);
  }
  return result;
}

async function db3(file) {
  let bytes = fs.readFileSync(file);
  if (file.endsWith(".zstd")) bytes = unpack("zstd")(bytes);
  const SQL = await initSqlJs();
  const db = new SQL.Database(bytes);
  const digest = new Digest();
  const rows = db.prepare(
    "SELECT topics.name, CAST(timestamp AS TEXT), data FROM messages JOIN topics ON topics.id = topic_id ORDER BY messages.id",
  );
  while (rows.step()) {
    let [topic, time, data] = rows.get();
    if (data[0] === 0x28) data = unpack("zstd")(data);
    digest.add(topic, "cdr", time, data);
  }
  return digest.done();
}

function bag(file) {
  // ROS' own library reads, and its index is used.
  const program = `
import hashlib, json, rosbag, struct, sys
topics = {}
with rosbag.Bag(sys.argv[1]) as bag:
    for topic, (kind, data, md5, place, cls), t in bag.read_messages(raw=True):
        d = topics.setdefault(topic, {"count": 0, "first_ns": None, "last_ns": None, "hash": hashlib.sha256()})
        s, ns = struct.unpack_from("<II", data, 4)
        at = s * 10**9 + ns
        d["hash"].update(data[:4] + bytes(8) + data[12:] + str(t.to_nsec()).encode())
        d["count"] += 1
        d["first_ns"] = at if d["first_ns"] is None else min(at, d["first_ns"])
        d["last_ns"] = at if d["last_ns"] is None else max(at, d["last_ns"])
print(json.dumps({k: {"count": d["count"], "first_ns": str(d["first_ns"]), "last_ns": str(d["last_ns"]), "sha256": d["hash"].hexdigest()} for k, d in sorted(topics.items())}))
`;
  return JSON.parse(execFileSync("/usr/bin/python3", ["-c", program, file], { encoding: "utf8" }));
}

const out = {};
for (const file of process.argv.slice(2))
  out[file] = file.endsWith(".mcap") ? await mcap(file) : file.endsWith(".bag") ? bag(file) : await db3(file);
console.log(JSON.stringify(out));
