// SPDX-License-Identifier: Apache-2.0
// Reads commands from the host's bytes: sync, operation, address, token, value, CRC. Whatever does not sum up is counted
// and otherwise ignored: the host asks again when no answer comes.
// `request_start_o` is the first byte's start bit, which begins a time exchange.
module takt_command #(
  parameter bit Diagnostics = 1'b1
) (
  input  logic        clk_i,
  input  logic        rst_ni,
  input  logic        byte_start_i,
  input  logic        byte_valid_i,
  input  logic [7:0]  byte_i,
  input  logic        busy_i,     // the command before is still being answered: this one is refused
  output logic        valid_o,
  output logic [3:0]  version_o,
  output logic [3:0]  operation_o,
  output logic [7:0]  address_o,
  output logic [7:0]  token_o,
  output logic [31:0] value_o,
  output logic        request_start_o,
  output logic [7:0]  broken_o,   // commands whose CRC was wrong
  output logic [7:0]  refused_o
);
  logic [3:0] index_q;
  logic [55:0] body_q;  // bytes 2 to 8, shifted in from above
  logic [15:0] crc_q;
  logic [7:0] broken_q, refused_q;
  logic complete_q, valid_q;

  always_ff @(posedge clk_i) begin
    complete_q <= 1'b0;
    valid_q    <= complete_q & (crc_q == 16'd0) & ~busy_i & rst_ni;
    if (complete_q) begin
      if (crc_q != 16'd0) broken_q <= broken_q + 1'b1;
      else if (busy_i) refused_q <= refused_q + 1'b1;
    end
    if (!rst_ni) begin
      index_q   <= '0;
      broken_q  <= '0;
      refused_q <= '0;
    end else if (byte_valid_i) begin
      case (index_q)
        4'd0: if (byte_i == takt_pkg::CommandSync0) index_q <= 4'd1;
        4'd1: begin
          index_q <= (byte_i == takt_pkg::CommandSync1) ? 4'd2 : 4'd0;
          crc_q   <= '1;
        end
        default: begin
          // The CRC comes with its high byte first: summed up too, it leaves nothing.
          if (!busy_i && index_q < 4'd9) body_q <= {byte_i, body_q[55:8]};
          crc_q      <= takt_pkg::crc16(crc_q, byte_i);
          complete_q <= index_q == 4'd10;
          index_q    <= (index_q == 4'd10) ? 4'd0 : index_q + 4'd1;
        end
      endcase
    end
  end

  assign valid_o         = valid_q;
  assign operation_o     = body_q[3:0];
  assign version_o       = body_q[7:4];
  assign address_o       = body_q[15:8];
  assign token_o         = body_q[23:16];
  assign value_o         = body_q[55:24];
  // While an answer is under way its times must stay.
  assign request_start_o = byte_start_i & (index_q == 4'd0) & ~busy_i;
  assign broken_o        = Diagnostics ? broken_q : '0;
  assign refused_o       = Diagnostics ? refused_q : '0;
endmodule
