// SPDX-License-Identifier: Apache-2.0
// Records in block memory. `full_o` is registered, so it comes one place early: that place takes what is written meanwhile.
// `data_o` belongs to the oldest record while `valid_o` is up.
module takt_fifo #(
  parameter int Width = 128,
  parameter int Log2Depth = 8
) (
  input  logic               clk_i,
  input  logic               rst_ni,
  input  logic               write_i,  // not while full_o
  input  logic [Width-1:0]   data_i,
  output logic               full_o,
  input  logic               pop_i,    // only while valid_o
  output logic               valid_o,
  output logic [Width-1:0]   data_o,
  output logic [Log2Depth:0] level_o
);
  localparam int Depth = 1 << Log2Depth;
  localparam int LevelW = Log2Depth + 1;
  localparam logic [LevelW-1:0] FullLevel = LevelW'(Depth - 1);

  // What is read from a place while it is being written does not matter: it is not valid yet.
  (* no_rw_check *) logic [Width-1:0] memory[0:Depth-1];
  logic [Log2Depth-1:0] write_q, read_q;
  logic [LevelW-1:0] level_q;
  logic full_q, valid_q;
  logic [Width-1:0] data_q;

  always_ff @(posedge clk_i) begin
    if (write_i) memory[write_q] <= data_i;
    data_q <= memory[read_q];
  end

  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      write_q <= '0;
      read_q  <= '0;
      level_q <= '0;
      full_q  <= 1'b0;
      valid_q <= 1'b0;
    end else begin
      if (write_i) write_q <= write_q + 1'b1;
      if (pop_i) read_q <= read_q + 1'b1;
      if (write_i & ~pop_i) level_q <= level_q + 1'b1;
      else if (pop_i & ~write_i) level_q <= level_q - 1'b1;
      full_q  <= level_q >= FullLevel;
      // A record can be read one clock after it was written, and its successor one clock after a pop.
      valid_q <= (level_q != '0) & ~pop_i;
    end
  end

  assign full_o  = full_q;
  assign valid_o = valid_q;
  assign data_o  = data_q;
  assign level_o = level_q;
endmodule
