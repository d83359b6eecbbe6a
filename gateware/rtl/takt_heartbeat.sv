// SPDX-License-Identifier: Apache-2.0
// One event after reset and one each time `period_bit_i` changes. They take turns with four words that say what the device is
// and how it fares, so that a recording explains itself.
module takt_heartbeat (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic       period_bit_i,  // a bit of the counter
  output logic       event_o,
  output logic [1:0] word_o
);
  logic bit_q, first_q;
  logic [1:0] word_q;

  always_ff @(posedge clk_i) begin
    bit_q <= period_bit_i;
    if (!rst_ni) begin
      first_q <= 1'b1;
      word_q  <= 2'd0;
      event_o <= 1'b0;
    end else begin
      first_q <= 1'b0;
      event_o <= first_q | (bit_q != period_bit_i);
      if (event_o) word_q <= word_q + 1'b1;
    end
  end

  assign word_o = word_q;
endmodule
