// SPDX-License-Identifier: Apache-2.0
// Records into bytes: sync, the record's sixteen bytes, CRC. The frame of a time exchange gets part of its payload late: how
// many ticks lie between its stamp and its own first bit.
module takt_framer (
  input  logic               clk_i,
  input  logic               rst_ni,
  input  logic               valid_i,
  input  takt_pkg::record_t  record_i,
  output logic               pop_o,
  input  logic [23:0]        delay_i,
  output logic               byte_valid_o,
  output logic [7:0]         byte_o,
  output logic               byte_mark_o,  // the first byte of a time exchange: the transport reports its start
  input  logic               byte_ready_i
);
  localparam logic [4:0] LastByte = takt_pkg::FrameBytes - 5'd1;

  logic [4:0] index_q;
  logic [7:0] byte_q;
  logic [15:0] crc_q;
  logic [1:0] wait_q;  // clocks until byte_q follows index_q
  logic pop_q;
  logic sent, exchange;

  assign exchange = record_i.kind == takt_pkg::Exchange;
  assign sent     = byte_valid_o & byte_ready_i;

  // Byte n of a frame, 2 ≤ n < 18, stands at place n mod 16, so that the place needs no arithmetic. It is chosen in two
  // clocks, out of each four and then out of the four that are left: sixteen to one is too slow for the UP5K.
  logic [127:0] bits, places;
  logic [31:0] fours_q;
  logic [7:0] chosen;
  assign bits   = {record_i.payload[31:24], exchange ? delay_i : record_i.payload[23:0], record_i.stamp,
                   record_i.sequence_number, record_i.flags, record_i.channel, record_i.version, record_i.kind};
  assign places = {bits[111:0], bits[127:112]};
  always_comb begin
    chosen = fours_q[{index_q[3:2], 3'b000}+:8];
    if (index_q == 5'd0) chosen = takt_pkg::FrameSync0;
    if (index_q == 5'd1) chosen = takt_pkg::FrameSync1;
    if (index_q == 5'd18) chosen = crc_q[15:8];
    if (index_q == 5'd19) chosen = crc_q[7:0];
  end

  always_ff @(posedge clk_i) begin
    for (int i = 0; i < 4; i++) fours_q[8*i+:8] <= places[{2'(i), index_q[1:0], 3'b000}+:8];
    byte_q <= chosen;
    pop_q  <= 1'b0;
    if (!rst_ni) begin
      index_q <= '0;
      wait_q  <= 2'd3;
      crc_q   <= '1;
    end else if (sent) begin
      // Sync and CRC are not summed up; the sum starts anew before byte 2.
      if (index_q < 5'd2) crc_q <= '1;
      else if (index_q < 5'd18) crc_q <= takt_pkg::crc16(crc_q, byte_q);
      index_q <= (index_q == LastByte) ? 5'd0 : index_q + 5'd1;
      pop_q   <= index_q == LastByte;
      wait_q  <= 2'd3;
    end else if (wait_q != 2'd0) begin
      wait_q <= wait_q - 2'd1;
    end
  end

  assign pop_o        = pop_q;
  assign byte_valid_o = valid_i & (wait_q == 2'd0);
  assign byte_o       = byte_q;
  assign byte_mark_o  = exchange & (index_q == 5'd0);
endmodule
