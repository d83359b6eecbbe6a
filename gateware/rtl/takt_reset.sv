// SPDX-License-Identifier: Apache-2.0
// Reset ends a few clocks after the PLL has locked, in step with the clock.
module takt_reset (
  input  logic clk_i,
  input  logic locked_i,
  output logic rst_no
);
  logic [3:0] since_q;
  initial since_q = 4'd0;
  always_ff @(posedge clk_i) since_q <= {since_q[2:0], locked_i};
  assign rst_no = since_q[3];
endmodule
