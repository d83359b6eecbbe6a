// SPDX-License-Identifier: Apache-2.0
// No loss without its flag, no flag without a loss, and every stamp is the count in the event's own clock: one slot among
// others that do as they like, behind a FIFO that is full as it likes.
module loss (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic [3:0] event_i,
  input  logic       full_i,
  output logic       bad_o
);
  localparam int Slots = 4;
  localparam int LowBits = takt_pkg::LowBits;
  logic [8:0] count;
  logic [Slots-1:0] valid, overrun, take, unused;
  logic [Slots*LowBits-1:0] lows;
  logic drop, write, over, detail;
  logic [8:0] stamp;
  logic [15:0] number;
  takt_counter #(.Width(9)) counter (.clk_i, .rst_ni, .count_o(count));
  generate
    for (genvar i = 0; i < Slots; i++) begin : gen_slot
      takt_slot #(.Width(1)) slot (
        .clk_i, .rst_ni, .event_i(event_i[i]), .detail_i(1'b0), .low_i(count[LowBits-1:0]), .take_i(take[i]), .drop_i(drop),
        .valid_o(valid[i]), .overrun_o(overrun[i]), .low_o(lows[i*LowBits+:LowBits]), .detail_o(unused[i])
      );
    end
  endgenerate
  takt_scanner #(.Slots(Slots), .StampW(9), .DetailW(1)) dut (
    .clk_i, .rst_ni, .count_i(count), .valid_i(valid), .overrun_i(overrun), .low_i(lows), .detail_i(unused), .take_o(take),
    .drop_o(drop), .full_i, .write_o(write), .stamp_o(stamp), .sequence_o(number), .overrun_o(over), .detail_o(detail)
  );

  // What slot 1 should say, from its events and what left the scanner alone.
  logic started_q, waits_q, lost_q, owed_q;
  logic [8:0] at_q;
  logic written, dropped, accepted;
  initial started_q = 1'b0;
  assign written  = take[1] & write;
  assign dropped  = take[1] & ~write;
  assign accepted = event_i[1] & ~waits_q;
  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      started_q <= 1'b1;
      waits_q   <= 1'b0;
      lost_q    <= 1'b0;
      owed_q    <= 1'b0;
    end else begin
      if (accepted) begin
        at_q   <= count;
        owed_q <= lost_q;  // this event has to tell
      end
      waits_q <= accepted | (waits_q & ~take[1]);
      lost_q  <= (event_i[1] & waits_q) | dropped | (lost_q & ~accepted);
    end
  end
  assign bad_o = started_q & rst_ni &
                 ((written & ~waits_q) | (written & (over != owed_q)) | (written & (stamp != at_q)));
endmodule
