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
  logic [11:0] count, stamp;
  logic [Slots-1:0] valid, take;
  logic write, over;
  scanned_slots #(.Slots(Slots), .StampW(12)) dut (
    .clk_i, .rst_ni, .event_i, .full_i, .count_o(count), .valid_o(valid), .take_o(take), .write_o(write), .stamp_o(stamp),
    .overrun_o(over)
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
