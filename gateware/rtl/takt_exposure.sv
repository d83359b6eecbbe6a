// SPDX-License-Identifier: Apache-2.0
// Stamps both edges of a camera's exposure strobe. Both carry the number of their frame, which counts rising edges,
// lost ones too: the host joins start and end by number and never by order.
module takt_exposure #(
  parameter int FrameW = 16
) (
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
  output logic [takt_pkg::LowBits-1:0] low_o,
  output logic                         start_o,  // of the exposure; its end otherwise
  output logic [FrameW-1:0]            frame_o
);
  logic level, rise, fall;
  logic [FrameW-1:0] frames_q;

  takt_sync sync (.clk_i, .rst_ni, .pin_i, .invert_i, .level_o(level), .rise_o(rise), .fall_o(fall));

  // Counts from 1, so that a strobe that was up at the start ends as frame 0, which has no start.
  always_ff @(posedge clk_i) begin
    if (!rst_ni) frames_q <= '0;
    else if (rise & enable_i) frames_q <= frames_q + 1'b1;
  end

  // The number is complete one clock after the edge; the edge waits for it, and so does its stamp.
  logic event_q, start_q;
  logic [takt_pkg::LowBits-1:0] low_q;
  always_ff @(posedge clk_i) begin
    start_q <= rise;
    low_q   <= low_i;
    event_q <= rst_ni & enable_i & (rise | fall);
  end

  takt_slot #(.Width(FrameW + 1)) slot (
    .clk_i, .rst_ni, .event_i(event_q), .detail_i({start_q, frames_q}), .low_i(low_q), .take_i, .drop_i,
    .valid_o, .overrun_o, .low_o, .detail_o({start_o, frame_o})
  );
endmodule
