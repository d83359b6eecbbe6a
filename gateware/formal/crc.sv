// SPDX-License-Identifier: Apache-2.0
// Eight bits at once give what eight single steps of the shift register give, for any sum and any byte.
module crc (input logic clk_i, input logic start_i, input logic [15:0] sum_i, input logic [7:0] byte_i, output logic bad_o);
  logic [15:0] serial_q, parallel_q;
  logic [7:0] left_q;
  logic [3:0] steps_q;
  logic started_q;
  initial started_q = 1'b0;
  initial steps_q = 4'd0;
  always_ff @(posedge clk_i) begin
    if (start_i) begin
      started_q  <= 1'b1;
      serial_q   <= sum_i;
      parallel_q <= takt_pkg::crc16(sum_i, byte_i);
      left_q     <= byte_i;
      steps_q    <= 4'd8;
    end else if (steps_q != 4'd0) begin
      serial_q <= {serial_q[14:0], 1'b0} ^ ((serial_q[15] ^ left_q[7]) ? 16'h1021 : 16'h0000);
      left_q   <= {left_q[6:0], 1'b0};
      steps_q  <= steps_q - 4'd1;
    end
  end
  assign bad_o = started_q & (steps_q == 4'd0) & (serial_q != parallel_q);
endmodule
