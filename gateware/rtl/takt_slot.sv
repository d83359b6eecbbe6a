// SPDX-License-Identifier: Apache-2.0
// Holds one event until the scanner takes it: only the counter's low bits, because the scanner comes round soon.
// An event that finds the slot occupied, and a record that the scanner had to drop, are lost: the next event that is
// accepted says so. `Width` bits of detail are kept beside the stamp.
module takt_slot #(
  parameter int Width = 1
) (
  input  logic                         clk_i,
  input  logic                         rst_ni,
  input  logic                         event_i,
  input  logic [Width-1:0]             detail_i,
  input  logic [takt_pkg::LowBits-1:0] low_i,
  input  logic                         take_i,
  input  logic                         drop_i,  // with take_i: the record is lost
  output logic                         valid_o,
  output logic                         overrun_o,
  output logic [takt_pkg::LowBits-1:0] low_o,
  output logic [Width-1:0]             detail_o
);
  logic valid_q, overrun_q, lost_q;
  logic [takt_pkg::LowBits-1:0] low_q;
  logic [Width-1:0] detail_q;
  logic accept, refuse;

  // An event in the very clock of a take is refused: the scanner's signals stay out of the stamp's enable.
  assign accept = event_i & ~valid_q;
  assign refuse = event_i & valid_q;

  always_ff @(posedge clk_i) begin
    if (accept) begin
      low_q     <= low_i;
      detail_q  <= detail_i;
      overrun_q <= lost_q;
    end
    if (!rst_ni) begin
      valid_q <= 1'b0;
      lost_q  <= 1'b0;
    end else begin
      valid_q <= accept | (valid_q & ~take_i);
      lost_q  <= refuse | (take_i & drop_i) | (lost_q & ~accept);
    end
  end

  assign valid_o   = valid_q;
  assign overrun_o = overrun_q;
  assign low_o     = low_q;
  assign detail_o  = detail_q;
endmodule
