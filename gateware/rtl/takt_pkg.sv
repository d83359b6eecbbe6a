// SPDX-License-Identifier: Apache-2.0
// What docs/formats/wire.md fixes, in the words of the RTL.
package takt_pkg;
  localparam logic [3:0] WireVersion = 4'd1;

  // Device to host: sync, version and kind, flags and channel, sequence, stamp, payload, CRC.
  localparam logic [7:0] FrameSync0 = 8'hD5;
  localparam logic [7:0] FrameSync1 = 8'h7A;
  localparam logic [4:0] FrameBytes = 5'd20;

  // Host to device: sync, version and operation, address, token, value, CRC.
  localparam logic [7:0] CommandSync0 = 8'hC5;
  localparam logic [7:0] CommandSync1 = 8'h3A;

  typedef enum logic [3:0] {
    Heartbeat = 4'd0,
    Pulse     = 4'd1,
    GnssStart = 4'd2,
    GnssText  = 4'd3,
    DataReady = 4'd4,
    Exposure  = 4'd5,
    Trigger   = 4'd6,
    Reply     = 4'd8,   // bit 3: an answer to a command
    Exchange  = 4'd12
  } kind_e;

  localparam logic [3:0] OpRead     = 4'd1;
  localparam logic [3:0] OpWrite    = 4'd2;
  localparam logic [3:0] OpExchange = 4'd3;

  localparam logic [3:0] StatusOk         = 4'd0;
  localparam logic [3:0] StatusNoRegister = 4'd1;
  localparam logic [3:0] StatusReadOnly   = 4'd2;
  localparam logic [3:0] StatusUnknown    = 4'd3;
  localparam logic [3:0] StatusLate       = 4'd4;

  localparam logic [31:0] Identity = 32'h7461_6B74;  // "takt"

  localparam logic [7:0] RegId       = 8'h00;
  localparam logic [7:0] RegClock    = 8'h01;
  localparam logic [7:0] RegFeatures = 8'h02;
  localparam logic [7:0] RegEnable   = 8'h04;
  localparam logic [7:0] RegInvert   = 8'h05;
  localparam logic [7:0] RegGnssBit  = 8'h06;
  localparam logic [7:0] RegRun      = 8'h08;
  localparam logic [7:0] RegTrigger  = 8'h10;  // + 4·trigger: last, rise, fall

  // The low bits of the counter that a slot keeps: the scanner comes round in less than half their range.
  localparam int LowBits = 6;

  // Bytes 2 to 17 of a frame, the first one in the lowest bits.
  typedef struct packed {
    logic [31:0] payload;
    logic [63:0] stamp;
    logic [15:0] sequence_number;
    logic [3:0]  flags;
    logic [3:0]  channel;
    logic [3:0]  version;
    logic [3:0]  kind;
  } record_t;

  // CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF), eight bits at once, most significant bit first.
  function automatic logic [15:0] crc16(input logic [15:0] crc, input logic [7:0] data);
    logic [7:0] x;
    logic [15:0] y;
    x = crc[15:8] ^ data;
    x = x ^ {4'b0, x[7:4]};
    y = {crc[7:0], 8'h0} ^ {x[3:0], 12'h0} ^ {3'b0, x, 5'h0} ^ {8'h0, x};
    crc16 = y;
  endfunction
endpackage
