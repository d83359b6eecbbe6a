// SPDX-License-Identifier: Apache-2.0
// Whatever is written comes out once and in order, and nothing else: a marked word, chosen freely, is followed from its
// write to its pop. The level never passes the depth.
module fifo (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic       write_i,
  input  logic       pop_i,
  input  logic       mark_i,
  input  logic       data_i,
  output logic       bad_o
);
  logic full, valid, data, write, pop;
  logic [3:0] level;
  assign write = write_i & ~full;
  assign pop   = pop_i & valid;
  takt_fifo #(.Width(1), .Log2Depth(3)) dut (
    .clk_i, .rst_ni, .write_i(write), .data_i, .full_o(full), .pop_i(pop), .valid_o(valid), .data_o(data), .level_o(level)
  );

  logic started_q, waits_q, word_q;
  logic [4:0] before_q, inside_q;  // words before the marked one; all words, counted apart from the block
  initial started_q = 1'b0;
  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      started_q <= 1'b1;
      waits_q   <= 1'b0;
      inside_q  <= '0;
    end else begin
      inside_q <= inside_q + 5'(write) - 5'(pop);
      if (write & mark_i & ~waits_q) begin
        waits_q  <= 1'b1;
        word_q   <= data_i;
        before_q <= inside_q - 5'(pop);
      end else if (pop & waits_q) begin
        if (before_q == '0) waits_q <= 1'b0;
        before_q <= before_q - 5'd1;
      end
    end
  end
  assign bad_o = started_q & rst_ni &
                 ((waits_q & valid & (before_q == '0) & (data != word_q)) | (inside_q > 5'd8) | (pop & (inside_q == '0)));
endmodule
