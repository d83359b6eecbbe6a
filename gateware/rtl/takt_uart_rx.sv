// SPDX-License-Identifier: Apache-2.0
// Eight bits, no parity, one stop bit, lowest bit first; the time of a bit is given in clocks, 4 or more.
module takt_uart_rx #(
  parameter int TimerW = 16
) (
  input  logic              clk_i,
  input  logic              rst_ni,
  input  logic [TimerW-1:0] clocks_per_bit_i,
  input  logic              level_i,  // from takt_sync
  input  logic              fall_i,
  output logic              start_o,  // a start bit has begun: the counter's value in this clock is its stamp
  output logic              valid_o,
  output logic [7:0]        byte_o,
  output logic              error_o,  // the stop bit was not there; the byte is not given
  output logic              tick_o    // the middle of every bit, and as often while idle
);
  logic busy_q, valid_q, error_q, over_q;
  logic [TimerW-1:0] timer_q, last_q;
  logic [3:0] left_q;
  logic [7:0] shift_q;
  logic start;

  assign start = fall_i & ~busy_q;

  // The timer runs from 0 to clocks_per_bit − 1; half a bit for the start bit, which is thus sampled in its middle.
  // `over_q` is the registered comparison of one clock before.
  logic clear;
  assign clear = start | over_q;
  always_ff @(posedge clk_i) begin
    if (start) last_q <= {1'b0, clocks_per_bit_i[TimerW-1:1]} - TimerW'(2);
    else if (over_q || !rst_ni) last_q <= clocks_per_bit_i - TimerW'(2);
    over_q <= (timer_q == last_q) & ~clear & rst_ni;
    if (clear || !rst_ni) timer_q <= '0;
    else timer_q <= timer_q + 1'b1;
  end

  always_ff @(posedge clk_i) begin
    valid_q <= 1'b0;
    error_q <= 1'b0;
    if (!rst_ni) begin
      busy_q <= 1'b0;
      left_q <= '0;
    end else if (start) begin
      busy_q <= 1'b1;
      left_q <= 4'd9;
    end else if (busy_q & over_q) begin
      shift_q <= {level_i, shift_q[7:1]};
      left_q  <= left_q - 1'b1;
      if (left_q == 4'd9 && level_i) busy_q <= 1'b0;  // a glitch, no start bit
      if (left_q == 4'd0) begin
        shift_q <= shift_q;
        busy_q  <= 1'b0;
        valid_q <= level_i;
        error_q <= ~level_i;
      end
    end
  end

  assign start_o = start;
  assign valid_o = valid_q;
  assign byte_o  = shift_q;
  assign error_o = error_q;
  assign tick_o  = over_q & ~busy_q;
endmodule
