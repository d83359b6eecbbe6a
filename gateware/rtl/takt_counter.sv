// SPDX-License-Identifier: Apache-2.0
// The free-running counter. Its upper half counts on a look-ahead that was registered one clock before, so that
// no carry chain is longer than half the counter.
module takt_counter #(
  parameter int Width = 64,
  parameter logic [63:0] ResetValue = 64'd0
) (
  input  logic             clk_i,
  input  logic             rst_ni,
  output logic [Width-1:0] count_o
);
  localparam int LowW = Width / 2;
  localparam int HighW = Width - LowW;
  // One before the low half's last value: the look-ahead is registered while the low half takes that last step.
  localparam logic [LowW-1:0] BeforeLast = {{(LowW - 1){1'b1}}, 1'b0};

  logic [LowW-1:0]  low_q;
  logic [HighW-1:0] high_q;
  logic             carry_q;

  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      low_q   <= ResetValue[LowW-1:0];
      high_q  <= ResetValue[Width-1:LowW];
      carry_q <= ResetValue[LowW-1:0] == {LowW{1'b1}};
    end else begin
      low_q   <= low_q + 1'b1;
      carry_q <= low_q == BeforeLast;
      if (carry_q) high_q <= high_q + 1'b1;
    end
  end

  assign count_o = {high_q, low_q};
endmodule
