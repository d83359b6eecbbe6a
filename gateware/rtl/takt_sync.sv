// SPDX-License-Identifier: Apache-2.0
// Two flip-flops between a pin and the clock, and one more to see edges.
// `rise_o` and `fall_o` last one clock; the counter's value in that clock is the edge's stamp s, and the pin changed
// in [s, s + 1) on the time scale of docs/formats/wire.md.
module takt_sync #(
  parameter bit IdleLevel = 1'b0
) (
  input  logic clk_i,
  input  logic rst_ni,
  input  logic pin_i,
  input  logic invert_i,
  output logic level_o,
  output logic rise_o,
  output logic fall_o
);
  logic meta_q, level_q, before_q, settled_q;
  logic [1:0] since_reset_q;

  always_ff @(posedge clk_i) begin
    meta_q   <= pin_i;
    level_q  <= meta_q ^ invert_i;
    before_q <= level_q;
    if (!rst_ni) begin
      before_q      <= IdleLevel;
      level_q       <= IdleLevel;
      since_reset_q <= '0;
      settled_q     <= 1'b0;
    end else begin
      // The level that a pin has at the start is no edge.
      since_reset_q <= {since_reset_q[0], 1'b1};
      settled_q     <= since_reset_q[1];
    end
  end

  assign level_o = level_q;
  assign rise_o  = settled_q & level_q & ~before_q;
  assign fall_o  = settled_q & ~level_q & before_q;
endmodule
