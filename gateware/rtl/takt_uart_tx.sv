// SPDX-License-Identifier: Apache-2.0
// Eight bits, no parity, one stop bit, lowest bit first. A byte takes 10·ClocksPerBit + 1 clocks.
module takt_uart_tx #(
  parameter int ClocksPerBit = 16
) (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic       valid_i,
  input  logic [7:0] byte_i,
  input  logic       mark_i,
  output logic       ready_o,
  output logic       start_o,  // a marked byte's start bit has begun: the counter's value in this clock is its stamp
  output logic       pin_o
);
  localparam int TimerW = $clog2(ClocksPerBit);
  localparam logic [TimerW-1:0] LastClock = TimerW'(ClocksPerBit - 1);

  logic busy_q, pin_q, mark1_q, mark2_q, mark3_q;
  logic [TimerW-1:0] timer_q;
  logic [3:0] left_q;   // bits after the present one
  logic [8:0] shift_q;
  logic accept, bit_over;

  assign accept   = valid_i & ~busy_q;
  assign bit_over = timer_q == LastClock;

  always_ff @(posedge clk_i) begin
    mark1_q <= accept & mark_i;
    mark2_q <= mark1_q;
    mark3_q <= mark2_q;  // as long as an edge takes through takt_sync
    if (!rst_ni) begin
      busy_q  <= 1'b0;
      pin_q   <= 1'b1;
      timer_q <= '0;
      left_q  <= '0;
      mark1_q <= 1'b0;
    end else if (accept) begin
      busy_q  <= 1'b1;
      pin_q   <= 1'b0;
      shift_q <= {1'b1, byte_i};
      timer_q <= '0;
      left_q  <= 4'd9;
    end else if (busy_q) begin
      timer_q <= bit_over ? '0 : timer_q + 1'b1;
      if (bit_over) begin
        pin_q   <= shift_q[0];
        shift_q <= {1'b1, shift_q[8:1]};
        left_q  <= left_q - 1'b1;
        if (left_q == 4'd0) busy_q <= 1'b0;
      end
    end
  end

  assign ready_o = ~busy_q;
  assign start_o = mark3_q;
  assign pin_o   = pin_q;
endmodule
