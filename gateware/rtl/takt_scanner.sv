// SPDX-License-Identifier: Apache-2.0
// Round-robin arbiter: visits one slot a clock, in turn, whether it is occupied or not. Each slot is thus served once
// in `Slots` clocks, whatever the others do. What is found is numbered, gets the upper bits of its stamp, and goes to
// the FIFO; where that is full it is dropped, and its slot is told so.
//
// Three steps a visit: 0 select, 1 stamp, 2 write. A slot must not be visited again before step 2 is over: Slots ≥ 4.
module takt_scanner #(
  parameter int Slots = 8,
  parameter int StampW = 64,
  parameter int DetailW = 45  // of a slot: kind, channel, flags without overrun, payload
) (
  input  logic                                clk_i,
  input  logic                                rst_ni,
  input  logic [StampW-1:0]                   count_i,
  input  logic [Slots-1:0]                    valid_i,
  input  logic [Slots-1:0]                    overrun_i,
  input  logic [Slots*takt_pkg::LowBits-1:0]  low_i,
  input  logic [Slots*DetailW-1:0]            detail_i,
  output logic [Slots-1:0]                    take_o,
  output logic                                drop_o,
  input  logic                                full_i,
  output logic                                write_o,
  output logic [StampW-1:0]                   stamp_o,
  output logic [15:0]                         sequence_o,
  output logic                                overrun_o,
  output logic [DetailW-1:0]                  detail_o
);
  localparam int LowBits = takt_pkg::LowBits;
  localparam logic [3:0] LastSlot = 4'(Slots - 1);

  // Whose turn it is, as one bit for the selection and as a number for the memory of sequence numbers.
  logic [Slots-1:0] turn_q, turn1_q, turn2_q;
  logic [3:0] index_q, index1_q, index2_q;
  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      turn_q  <= Slots'(1);
      index_q <= 4'd0;
    end else begin
      turn_q  <= {turn_q[Slots-2:0], turn_q[Slots-1]};
      index_q <= (index_q == LastSlot) ? 4'd0 : index_q + 4'd1;
    end
    turn1_q  <= turn_q;
    turn2_q  <= turn1_q;
    index1_q <= index_q;
    index2_q <= index1_q;
  end

  // Step 0: select.
  logic valid1_q;
  logic [LowBits-1:0] low, low1_q;
  always_comb begin
    low = '0;
    for (int i = 0; i < Slots; i++) low = low | (low_i[i*LowBits+:LowBits] & {LowBits{turn_q[i]}});
  end
  always_ff @(posedge clk_i) begin
    valid1_q <= |(valid_i & turn_q) & rst_ni;
    low1_q   <= low;
  end

  // Step 1: stamp. An event is younger than half the range of its low bits, so the top one of them tells whether the
  // upper part has counted on since; then the upper part of before is the right one.
  logic [StampW-LowBits-1:0] before_q, upper;
  assign upper = (low1_q[LowBits-1] & ~count_i[LowBits-1]) ? before_q : count_i[StampW-1:LowBits];

  // What else the slot holds can wait until here; it stays until the take.
  logic [DetailW-1:0] detail;
  always_comb begin
    detail = '0;
    for (int i = 0; i < Slots; i++) detail = detail | (detail_i[i*DetailW+:DetailW] & {DetailW{turn1_q[i]}});
  end

  // Sequence numbers live in a memory, one a slot: read in step 1, written back in step 2.
  // A place is never read while it is being written.
  (* no_rw_check *) logic [15:0] next_q[0:15];
  logic [15:0] sequence2_q;
  initial for (int i = 0; i < 16; i++) next_q[i] = 16'd0;

  logic valid2_q, overrun2_q;
  logic [StampW-1:0] stamp2_q;
  logic [DetailW-1:0] detail2_q;
  always_ff @(posedge clk_i) begin
    if (&count_i[LowBits-1:0]) before_q <= count_i[StampW-1:LowBits];
    valid2_q    <= valid1_q & rst_ni;
    overrun2_q  <= |(overrun_i & turn1_q);
    stamp2_q    <= {upper, low1_q};
    detail2_q   <= detail;
    sequence2_q <= next_q[index1_q];
    if (valid2_q) next_q[index2_q] <= sequence2_q + 16'd1;
  end

  // Step 2: write or drop.
  assign take_o     = turn2_q & {Slots{valid2_q}};
  assign drop_o     = full_i;
  assign write_o    = valid2_q & ~full_i;
  assign stamp_o    = stamp2_q;
  assign sequence_o = sequence2_q;
  assign overrun_o  = overrun2_q;
  assign detail_o   = detail2_q;
endmodule
