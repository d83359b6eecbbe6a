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
  logic [8:0] count, stamp;
  logic [3:0] valid, take;
  logic write, over;
  scanned_slots #(.Slots(4), .StampW(9)) dut (
    .clk_i, .rst_ni, .event_i, .full_i, .count_o(count), .valid_o(valid), .take_o(take), .write_o(write), .stamp_o(stamp),
    .overrun_o(over)
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
