// SPDX-License-Identifier: Apache-2.0
// The registers of docs/formats/wire.md. A memory holds what the host reads back; what acts stands in flip-flops beside it.
// Five clocks after a command `answer_o` is up: its stamp plus `rise` is the stamp of the first pulse of every trigger that
// the command started.
module takt_registers #(
  parameter int Triggers = 4,
  parameter int TriggerW = 28,
  parameter logic [31:0] ClockHz = 32'd48_000_000,
  parameter logic [31:0] Features = 32'd0,
  parameter logic [15:0] GnssBit = 16'd5000
) (
  input  logic                         clk_i,
  input  logic                         rst_ni,
  input  logic                         valid_i,
  input  logic [3:0]                   version_i,
  input  logic [3:0]                   operation_i,
  input  logic [7:0]                   address_i,
  input  logic [31:0]                  value_i,
  input  logic                         late_i,  // the command took too long to come for a time exchange
  output logic                         answer_o,
  output logic                         is_exchange_o,
  output logic [3:0]                   status_o,
  output logic [31:0]                  payload_o,
  output logic [23:0]                  enable_o,
  output logic [15:0]                  invert_o,
  output logic [15:0]                  gnss_bit_o,
  output logic [Triggers-1:0]          run_o,
  output logic [Triggers*TriggerW-1:0] last_o,
  output logic [Triggers*TriggerW-1:0] rise_o,
  output logic [Triggers*TriggerW-1:0] fall_o
);
  // What is read from a place while it is being written does not matter: it is read again before the answer.
  (* no_rw_check *) logic [31:0] memory[0:63];
  initial begin
    for (int i = 0; i < 64; i++) memory[i] = 32'd0;
    memory[6'(takt_pkg::RegId)]       = takt_pkg::Identity;
    memory[6'(takt_pkg::RegClock)]    = ClockHz;
    memory[6'(takt_pkg::RegFeatures)] = Features;
    memory[6'(takt_pkg::RegEnable)]   = 32'h00FF_FFFF;
    memory[6'(takt_pkg::RegGnssBit)]  = {16'd0, GnssBit};
  end

  // The address is judged one clock before it matters.
  logic [Triggers*3-1:0] is_trigger_q;
  logic is_enable_q, is_invert_q, is_gnss_q, is_run_q, is_constant_q, known_q, valid1_q;
  always_ff @(posedge clk_i) begin
    for (int i = 0; i < Triggers; i++)
      for (int j = 0; j < 3; j++) is_trigger_q[3*i+j] <= address_i == takt_pkg::RegTrigger + 8'(4 * i + j);
    is_enable_q   <= address_i == takt_pkg::RegEnable;
    is_invert_q   <= address_i == takt_pkg::RegInvert;
    is_gnss_q     <= address_i == takt_pkg::RegGnssBit;
    is_run_q      <= address_i == takt_pkg::RegRun;
    is_constant_q <= address_i <= takt_pkg::RegFeatures;
    known_q       <= version_i == takt_pkg::WireVersion && operation_i != 4'd0 && operation_i <= takt_pkg::OpExchange;
    valid1_q      <= valid_i & rst_ni;
  end

  // The address came several bytes before the command is complete: there is time for one more step.
  logic write, writable_q, is_write_q;
  always_ff @(posedge clk_i) begin
    writable_q <= (|is_trigger_q) | is_enable_q | is_invert_q | is_gnss_q | is_run_q;
    is_write_q <= known_q && operation_i == takt_pkg::OpWrite;
  end
  assign write = valid1_q & is_write_q;

  logic [31:0] read_q;
  always_ff @(posedge clk_i) begin
    if (write & writable_q) memory[address_i[5:0]] <= value_i;
    read_q <= memory[address_i[5:0]];
  end

  logic [23:0] enable_q;
  logic [15:0] invert_q, gnss_bit_q;
  logic [Triggers-1:0] run_q;
  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      enable_q   <= '1;
      invert_q   <= '0;
      gnss_bit_q <= GnssBit;
      run_q      <= '0;
    end else if (write) begin
      if (is_enable_q) enable_q <= value_i[23:0];
      if (is_invert_q) invert_q <= value_i[15:0];
      if (is_gnss_q) gnss_bit_q <= value_i[15:0];
      if (is_run_q) run_q <= value_i[Triggers-1:0];
      // A trigger stops when its numbers change, and starts again with the others that it belongs to.
      for (int i = 0; i < Triggers; i++) if (|is_trigger_q[3*i+:3]) run_q[i] <= 1'b0;
    end
  end
  generate
    for (genvar i = 0; i < Triggers; i++) begin : gen_trigger
      logic [TriggerW-1:0] last_q, rise_q, fall_q;
      always_ff @(posedge clk_i) begin
        if (write & is_trigger_q[3*i]) last_q <= value_i[TriggerW-1:0];
        if (write & is_trigger_q[3*i+1]) rise_q <= value_i[TriggerW-1:0];
        if (write & is_trigger_q[3*i+2]) fall_q <= value_i[TriggerW-1:0];
      end
      assign last_o[i*TriggerW+:TriggerW] = last_q;
      assign rise_o[i*TriggerW+:TriggerW] = rise_q;
      assign fall_o[i*TriggerW+:TriggerW] = fall_q;
    end
  endgenerate

  logic valid2_q, valid3_q, valid4_q, valid5_q, valid6_q, is_exchange;
  assign is_exchange = operation_i == takt_pkg::OpExchange;
  always_ff @(posedge clk_i) begin
    valid2_q <= valid1_q & rst_ni;
    valid3_q <= valid2_q & rst_ni;
    valid4_q <= valid3_q & rst_ni;
    valid5_q <= valid4_q & rst_ni;
    valid6_q <= valid5_q & rst_ni;
  end
  always_comb begin
    status_o = takt_pkg::StatusOk;
    if (!known_q) status_o = takt_pkg::StatusUnknown;
    else if (is_exchange) status_o = late_i ? takt_pkg::StatusLate : takt_pkg::StatusOk;
    else if (!writable_q && !is_constant_q) status_o = takt_pkg::StatusNoRegister;
    else if (operation_i == takt_pkg::OpWrite && !writable_q) status_o = takt_pkg::StatusReadOnly;
    // Run is read from the flip-flops: a trigger may have been stopped since it was written.
    payload_o = read_q;
    if (is_run_q) payload_o[Triggers-1:0] = run_q;
  end

  assign answer_o      = valid6_q;
  assign is_exchange_o = known_q & is_exchange & ~late_i;
  assign enable_o      = enable_q;
  assign invert_o      = invert_q;
  assign gnss_bit_o    = gnss_bit_q;
  assign run_o         = run_q;
endmodule
