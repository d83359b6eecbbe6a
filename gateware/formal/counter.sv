// SPDX-License-Identifier: Apache-2.0
// The split counter counts like a plain one, from any start.
module counter (input logic clk_i, input logic rst_ni, output logic bad_o);
  logic [11:0] count, plain_q;
  logic started_q;
  initial started_q = 1'b0;
  takt_counter #(.Width(12), .ResetValue(64'h7BD)) dut (.clk_i, .rst_ni, .count_o(count));
  always_ff @(posedge clk_i) begin
    plain_q <= !rst_ni ? 12'h7BD : plain_q + 12'd1;
    if (!rst_ni) started_q <= 1'b1;
  end
  assign bad_o = started_q & (count != plain_q);
endmodule
