// SPDX-License-Identifier: Apache-2.0
// A slot that is occupied is served within one round and the scanner's own two clocks, whatever the others do, and no two
// slots are served at once.
module fairness (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic [4:0] event_i,
  input  logic       full_i,
  output logic       bad_o
);
  localparam int Slots = 5;
  localparam int LowBits = takt_pkg::LowBits;
  logic [11:0] count;
  logic [Slots-1:0] valid, overrun, take, unused;
  logic [Slots*LowBits-1:0] lows;
  logic drop, write, over, detail;
  logic [11:0] stamp;
  logic [15:0] number;
  takt_counter #(.Width(12)) counter (.clk_i, .rst_ni, .count_o(count));
  generate
    for (genvar i = 0; i < Slots; i++) begin : gen_slot
      takt_slot #(.Width(1)) slot (
        .clk_i, .rst_ni, .event_i(event_i[i]), .detail_i(1'b0), .low_i(count[LowBits-1:0]), .take_i(take[i]), .drop_i(drop),
        .valid_o(valid[i]), .overrun_o(overrun[i]), .low_o(lows[i*LowBits+:LowBits]), .detail_o(unused[i])
      );
    end
  endgenerate
  takt_scanner #(.Slots(Slots), .StampW(12), .DetailW(1)) dut (
    .clk_i, .rst_ni, .count_i(count), .valid_i(valid), .overrun_i(overrun), .low_i(lows), .detail_i(unused), .take_o(take),
    .drop_o(drop), .full_i, .write_o(write), .stamp_o(stamp), .sequence_o(number), .overrun_o(over), .detail_o(detail)
  );

  logic started_q;
  logic [3:0] waited_q;
  initial started_q = 1'b0;
  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      started_q <= 1'b1;
      waited_q  <= '0;
    end else begin
      waited_q <= (valid[2] & ~take[2]) ? waited_q + 4'd1 : 4'd0;
    end
  end
  // Served in the clock numbered Slots + 1 of waiting at the latest.
  assign bad_o = started_q & rst_ni & ((waited_q > 4'(Slots + 1)) | ((take & (take - 5'd1)) != '0));
endmodule
