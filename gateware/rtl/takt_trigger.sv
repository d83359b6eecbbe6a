// SPDX-License-Identifier: Apache-2.0
// Divides the clock into a pulse: the count runs 0 … period − 1, the pin rises `rise` and falls `fall` ticks after 0.
// The report waits as long as an edge takes through takt_sync: a capture that is wired to the pin gives the same stamp.
// `last_i` is the period less 2: the comparison is registered, and the count is cleared synchronously, so that no
// multiplexer stands before the carry chain.
module takt_trigger #(
  parameter int Width = 28
) (
  input  logic             clk_i,
  input  logic             rst_ni,
  input  logic             run_i,
  input  logic [Width-1:0] last_i,
  input  logic [Width-1:0] rise_i,
  input  logic [Width-1:0] fall_i,
  output logic             pin_o,
  output logic             event_o  // the counter's value in this clock is the stamp of the rising edge, exactly
);
  logic [Width-1:0] count_q;
  logic last_q, rise_q, fall_q, pin_q, pin1_q, pin2_q, pin3_q;

  always_ff @(posedge clk_i) begin
    last_q <= run_i & (count_q == last_i);
    rise_q <= run_i & (count_q == rise_i);
    fall_q <= run_i & (count_q == fall_i);
    if (!run_i || last_q) count_q <= '0;
    else count_q <= count_q + 1'b1;

    if (!rst_ni || !run_i) pin_q <= 1'b0;
    else pin_q <= rise_q | (pin_q & ~fall_q);
    pin1_q <= pin_q & rst_ni;
    pin2_q <= pin1_q;
    pin3_q <= pin2_q;
  end

  assign pin_o   = pin_q;
  assign event_o = pin2_q & ~pin3_q;
endmodule
