// SPDX-License-Identifier: Apache-2.0
// What `fairness` and `loss` are about: slots whose events come as they like, before the scanner.
module scanned_slots #(
  parameter int Slots = 4,
  parameter int StampW = 9
) (
  input  logic              clk_i,
  input  logic              rst_ni,
  input  logic [Slots-1:0]  event_i,
  input  logic              full_i,
  output logic [StampW-1:0] count_o,
  output logic [Slots-1:0]  valid_o,
  output logic [Slots-1:0]  take_o,
  output logic              write_o,
  output logic [StampW-1:0] stamp_o,
  output logic              overrun_o
);
  localparam int LowBits = takt_pkg::LowBits;
  logic [Slots-1:0] overrun, details;
  logic [Slots*LowBits-1:0] lows;
  logic drop, detail;
  logic [15:0] number;
  takt_counter #(.Width(StampW)) counter (.clk_i, .rst_ni, .count_o);
  generate
    for (genvar i = 0; i < Slots; i++) begin : gen_slot
      takt_slot #(.Width(1)) slot (
        .clk_i, .rst_ni, .event_i(event_i[i]), .detail_i(1'b0), .low_i(count_o[LowBits-1:0]), .take_i(take_o[i]),
        .drop_i(drop), .valid_o(valid_o[i]), .overrun_o(overrun[i]), .low_o(lows[i*LowBits+:LowBits]), .detail_o(details[i])
      );
    end
  endgenerate
  takt_scanner #(.Slots(Slots), .StampW(StampW), .DetailW(1)) scanner (
    .clk_i, .rst_ni, .count_i(count_o), .valid_i(valid_o), .overrun_i(overrun), .low_i(lows), .detail_i(details), .take_o,
    .drop_o(drop), .full_i, .write_o, .stamp_o, .sequence_o(number), .overrun_o, .detail_o(detail)
  );
endmodule
