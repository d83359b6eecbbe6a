// SPDX-License-Identifier: Apache-2.0
// Listens to a GNSS receiver's UART. `start_o` is the first start bit after the line was idle for the time of 31 bits: the
// beginning of a burst of messages, on the same counter as the pulse. The bytes themselves follow, up to four a record.
module takt_gnss #(
  parameter bit WithText = 1'b1
) (
  input  logic        clk_i,
  input  logic        rst_ni,
  input  logic        invert_i,
  input  logic        pin_i,
  input  logic [15:0] clocks_per_bit_i,
  input  logic        slow_bit_i,        // without text: a bit of the counter; the line is idle after 31 changes of it
  output logic        start_o,
  output logic        text_o,        // event: `bytes_o` is complete, and holds until the next byte
  output logic [31:0] bytes_o,       // the first one in the lowest bits
  output logic [1:0]  bytes_less_1_o
);
  logic level, rise, fall;
  takt_sync #(.IdleLevel(1'b1)) sync (
    .clk_i, .rst_ni, .pin_i, .invert_i, .level_o(level), .rise_o(rise), .fall_o(fall)
  );

  logic [4:0] idle_q;
  logic idle, start, tick;
  assign idle = &idle_q;
  always_ff @(posedge clk_i) begin
    if (!rst_ni || start || !level) idle_q <= '0;
    else if (tick & ~idle) idle_q <= idle_q + 1'b1;
  end
  assign start_o = start & idle;

  generate
    if (WithText) begin : gen_text
      logic valid, error;
      logic [7:0] data;
      takt_uart_rx #(.TimerW(16)) uart (
        .clk_i, .rst_ni, .clocks_per_bit_i, .level_i(level), .fall_i(fall), .start_o(start), .valid_o(valid), .byte_o(data),
        .error_o(error), .tick_o(tick)
      );

      logic [31:0] bytes_q;
      logic [1:0] count_q, less_1_q;  // bytes that wait; of those that were given out
      logic some_q, text_q;
      always_ff @(posedge clk_i) begin
        text_q <= 1'b0;
        if (!rst_ni) begin
          count_q <= '0;
          some_q  <= 1'b0;
        end else if (valid) begin
          for (int i = 0; i < 4; i++) if (count_q == 2'(i)) bytes_q[i*8+:8] <= data;
          count_q  <= count_q + 1'b1;
          some_q   <= count_q != 2'd3;
          text_q   <= count_q == 2'd3;
          less_1_q <= count_q;
        end else if (idle & some_q) begin
          count_q <= '0;
          some_q  <= 1'b0;
          text_q  <= 1'b1;
        end
      end
      assign text_o = text_q;
      assign bytes_o = bytes_q;
      assign bytes_less_1_o = less_1_q;
    end else begin : gen_no_text
      // No UART: a line that stayed up for so long is idle, at 9600 baud and faster.
      logic slow_q;
      always_ff @(posedge clk_i) slow_q <= slow_bit_i;
      assign tick  = slow_q != slow_bit_i;
      assign start = fall;
      assign text_o = 1'b0;
      assign bytes_o = '0;
      assign bytes_less_1_o = '0;
    end
  endgenerate
endmodule
