// SPDX-License-Identifier: Apache-2.0
// Stamps the rising edges of a pin: IMU data-ready, PPS.
module takt_capture (
  input  logic                         clk_i,
  input  logic                         rst_ni,
  input  logic                         enable_i,
  input  logic                         invert_i,
  input  logic                         pin_i,
  input  logic [takt_pkg::LowBits-1:0] low_i,
  input  logic                         take_i,
  input  logic                         drop_i,
  output logic                         valid_o,
  output logic                         overrun_o,
  output logic [takt_pkg::LowBits-1:0] low_o
);
  logic level, rise, fall, detail;

  takt_sync sync (.clk_i, .rst_ni, .pin_i, .invert_i, .level_o(level), .rise_o(rise), .fall_o(fall));

  takt_slot #(.Width(1)) slot (
    .clk_i, .rst_ni, .event_i(rise & enable_i), .detail_i(1'b0), .low_i, .take_i, .drop_i,
    .valid_o, .overrun_o, .low_o, .detail_o(detail)
  );
endmodule
