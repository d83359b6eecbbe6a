// SPDX-License-Identifier: Apache-2.0
// The whole device without its board: pins in, triggers out, frames to the host by UART or SPI.
//
//   pins -> sync -> slot --+                                              +-> uart_tx -> host
//   triggers --------> slot +-> scanner -> fifo -> framer (sync, CRC) ----+
//   heartbeat -------> slot +      ^ counter                              +-> spi
//   answer ----------> slot +      |
//      ^---- registers <---- command <---- uart_rx or spi <---- host
module takt_device #(
  parameter int ClockHz = 48_000_000,
  parameter int StampW = 64,
  parameter logic [63:0] FirstCount = 64'd0,
  parameter int Imus = 2,
  parameter int Cameras = 4,
  parameter int Triggers = 4,
  parameter int TriggerW = 28,
  parameter bit TriggerPhase = 1'b1,  // without: all triggers rise at the start of their period
  parameter bit Gnss = 1'b1,
  parameter bit GnssText = 1'b1,
  parameter int FrameW = 16,          // of the number of an exposure
  parameter int GnssBaud = 9600,
  parameter bit Diagnostics = 1'b1,
  parameter int FifoLog2 = 8,
  parameter int HeartbeatLog2 = 24,
  parameter bit Spi = 1'b0,
  parameter int ClocksPerBit = 16
) (
  input  logic                clk_i,
  input  logic                rst_ni,
  input  logic                pps_i,
  input  logic                gnss_rx_i,
  input  logic [Imus-1:0]     imu_ready_i,
  input  logic [Cameras-1:0]  exposure_i,
  output logic [Triggers-1:0] trigger_o,
  input  logic                uart_rx_i,
  output logic                uart_tx_o,
  input  logic                spi_sclk_i,
  input  logic                spi_cs_ni,
  input  logic                spi_mosi_i,
  output logic                spi_miso_o,
  output logic                spi_miso_enable_o
);
  // Places in the scanner's round.
  localparam int Answer = 0;
  localparam int Beat = 1;
  localparam int Pps = 2;
  localparam int Start = 3;
  localparam int Text = 4;
  localparam int FirstImu = 5;
  localparam int FirstCamera = FirstImu + Imus;
  localparam int FirstTrigger = FirstCamera + Cameras;
  localparam int Slots = FirstTrigger + Triggers;
  localparam int LowBits = takt_pkg::LowBits;
  // Of a slot: kind 42:39, channel 38:35, level and detail 34:32, payload 31:0.
  localparam int DetailW = 43;
  // Of a record in the FIFO: payload, stamp, sequence, flags, channel, kind.
  localparam int RecordW = 32 + StampW + 28;

  localparam logic [31:0] Features = {
    4'(FifoLog2), 6'd0, Spi, GnssText, 4'(Triggers), 4'(Cameras), 4'(Imus), 8'(StampW)
  };

  logic [StampW-1:0] count;
  logic [LowBits-1:0] low;
  takt_counter #(.Width(StampW), .ResetValue(FirstCount)) counter (.clk_i, .rst_ni, .count_o(count));
  assign low = count[LowBits-1:0];

  logic [Slots-1:0] valid, overrun, take;
  logic [Slots*LowBits-1:0] lows;
  logic [Slots*DetailW-1:0] details;
  logic drop;

  logic [23:0] enable;
  logic [15:0] invert, gnss_bit;
  logic [Triggers-1:0] run;
  logic [Triggers*TriggerW-1:0] last, rise, fall;

  // Answers to commands.
  logic answer, is_exchange, answer_exchange;
  logic [3:0] status;
  logic [31:0] answer_payload;
  logic [7:0] address, token;
  takt_slot #(.Width(1)) slot_answer (
    .clk_i, .rst_ni, .event_i(answer), .detail_i(is_exchange), .low_i(low), .take_i(take[Answer]), .drop_i(drop),
    .valid_o(valid[Answer]), .overrun_o(overrun[Answer]), .low_o(lows[Answer*LowBits+:LowBits]), .detail_o(answer_exchange)
  );
  assign details[Answer*DetailW+:DetailW] = {
    answer_exchange ? takt_pkg::Exchange : takt_pkg::Reply, status, 3'b000, answer_exchange ? {token, 24'd0} : answer_payload
  };

  // Heartbeat. Its own flag tells of losses on any channel since the one before.
  logic beat, loss_q, beat_loss;
  logic [1:0] word, beat_word;
  logic [31:0] words;
  logic [7:0] broken, refused, high_water_q, uart_errors_q;
  takt_heartbeat heartbeat (
    .clk_i, .rst_ni, .period_bit_i(count[HeartbeatLog2]), .event_o(beat), .word_o(word)
  );
  takt_slot #(.Width(3)) slot_beat (
    .clk_i, .rst_ni, .event_i(beat), .detail_i({loss_q, word}), .low_i(low), .take_i(take[Beat]), .drop_i(drop),
    .valid_o(valid[Beat]), .overrun_o(overrun[Beat]), .low_o(lows[Beat*LowBits+:LowBits]), .detail_o({beat_loss, beat_word})
  );
  always_comb begin
    case (beat_word)
      2'd0: words = 32'(ClockHz);
      2'd1: words = Features;
      2'd2: words = {uart_errors_q, high_water_q, refused, broken};
      default: words = takt_pkg::Identity;
    endcase
  end
  assign details[Beat*DetailW+:DetailW] = {takt_pkg::Heartbeat, 2'b00, beat_word, 2'b00, beat_loss, words};

  // The pulse of the GNSS receiver, and its messages.
  takt_capture capture_pps (
    .clk_i, .rst_ni, .enable_i(enable[0]), .invert_i(invert[0]), .pin_i(pps_i), .low_i(low), .take_i(take[Pps]),
    .drop_i(drop), .valid_o(valid[Pps]), .overrun_o(overrun[Pps]), .low_o(lows[Pps*LowBits+:LowBits])
  );
  assign details[Pps*DetailW+:DetailW] = {takt_pkg::Pulse, 4'd0, 3'b100, 32'd0};

  logic gnss_start, gnss_text, unused_start;
  logic [31:0] gnss_bytes;
  logic [1:0] gnss_less_1, text_less_1;
  takt_gnss #(.WithText(GnssText)) gnss (
    .clk_i, .rst_ni, .invert_i(invert[1]), .pin_i(gnss_rx_i), .clocks_per_bit_i(gnss_bit), .slow_bit_i(count[12]), .start_o(gnss_start),
    .text_o(gnss_text), .bytes_o(gnss_bytes), .bytes_less_1_o(gnss_less_1)
  );
  takt_slot #(.Width(1)) slot_start (
    .clk_i, .rst_ni, .event_i(Gnss & gnss_start & enable[1]), .detail_i(1'b0), .low_i(low), .take_i(take[Start]), .drop_i(drop),
    .valid_o(valid[Start]), .overrun_o(overrun[Start]), .low_o(lows[Start*LowBits+:LowBits]), .detail_o(unused_start)
  );
  assign details[Start*DetailW+:DetailW] = {takt_pkg::GnssStart, 4'd0, 3'b000, 32'd0};
  generate
    if (GnssText) begin : gen_text
      takt_slot #(.Width(2)) slot_text (
        .clk_i, .rst_ni, .event_i(gnss_text & enable[1]), .detail_i(gnss_less_1), .low_i(low), .take_i(take[Text]),
        .drop_i(drop), .valid_o(valid[Text]), .overrun_o(overrun[Text]), .low_o(lows[Text*LowBits+:LowBits]),
        .detail_o(text_less_1)
      );
      assign details[Text*DetailW+:DetailW] = {takt_pkg::GnssText, 4'd0, 1'b0, text_less_1, gnss_bytes};
    end else begin : gen_no_text
      assign valid[Text] = 1'b0;
      assign overrun[Text] = 1'b0;
      assign lows[Text*LowBits+:LowBits] = '0;
      assign details[Text*DetailW+:DetailW] = '0;
    end

    for (genvar i = 0; i < Imus; i++) begin : gen_imu
      localparam int S = FirstImu + i;
      takt_capture capture (
        .clk_i, .rst_ni, .enable_i(enable[4+i]), .invert_i(invert[4+i]), .pin_i(imu_ready_i[i]), .low_i(low),
        .take_i(take[S]), .drop_i(drop), .valid_o(valid[S]), .overrun_o(overrun[S]), .low_o(lows[S*LowBits+:LowBits])
      );
      assign details[S*DetailW+:DetailW] = {takt_pkg::DataReady, 4'(i), 3'b100, 32'd0};
    end

    for (genvar i = 0; i < Cameras; i++) begin : gen_camera
      localparam int S = FirstCamera + i;
      logic exposure_start;
      logic [FrameW-1:0] frame;
      takt_exposure #(.FrameW(FrameW)) capture (
        .clk_i, .rst_ni, .enable_i(enable[8+i]), .invert_i(invert[8+i]), .pin_i(exposure_i[i]), .low_i(low),
        .take_i(take[S]), .drop_i(drop), .valid_o(valid[S]), .overrun_o(overrun[S]), .low_o(lows[S*LowBits+:LowBits]),
        .start_o(exposure_start), .frame_o(frame)
      );
      assign details[S*DetailW+:DetailW] = {takt_pkg::Exposure, 4'(i), exposure_start, 2'b00, 32'(frame)};
    end

    for (genvar i = 0; i < Triggers; i++) begin : gen_trigger
      localparam int S = FirstTrigger + i;
      logic sent, unused;
      takt_trigger #(.Width(TriggerW)) trigger (
        .clk_i, .rst_ni, .run_i(run[i]), .last_i(last[i*TriggerW+:TriggerW]), .rise_i(TriggerPhase ? rise[i*TriggerW+:TriggerW] : '0),
        .fall_i(fall[i*TriggerW+:TriggerW]), .pin_o(trigger_o[i]), .event_o(sent)
      );
      takt_slot #(.Width(1)) slot (
        .clk_i, .rst_ni, .event_i(sent & enable[16+i]), .detail_i(1'b0), .low_i(low), .take_i(take[S]), .drop_i(drop),
        .valid_o(valid[S]), .overrun_o(overrun[S]), .low_o(lows[S*LowBits+:LowBits]), .detail_o(unused)
      );
      assign details[S*DetailW+:DetailW] = {takt_pkg::Trigger, 4'(i), 3'b100, 32'd0};
    end
  endgenerate

  // From slots to the FIFO.
  logic full, write, scanned_overrun;
  logic [StampW-1:0] stamp;
  logic [15:0] scanned_sequence;
  logic [DetailW-1:0] scanned;
  takt_scanner #(.Slots(Slots), .StampW(StampW), .DetailW(DetailW)) scanner (
    .clk_i, .rst_ni, .count_i(count), .valid_i(valid), .overrun_i(overrun), .low_i(lows), .detail_i(details), .take_o(take),
    .drop_o(drop), .full_i(full), .write_o(write), .stamp_o(stamp), .sequence_o(scanned_sequence),
    .overrun_o(scanned_overrun), .detail_o(scanned)
  );

  // In place of the sequence number an answer has what tells which command it answers, and a time exchange the ticks from
  // the command's first bit to the stamp.
  logic [15:0] age_q;
  logic [RecordW-1:0] record_in, record_out;
  assign record_in = {
    scanned[31:0], stamp, scanned[42] ? (scanned[41] ? age_q : {token, address}) : scanned_sequence, scanned_overrun,
    scanned[34:32], scanned[38:35], scanned[42:39]
  };

  logic pop, waiting;
  logic [FifoLog2:0] level;
  takt_fifo #(.Width(RecordW), .Log2Depth(FifoLog2)) fifo (
    .clk_i, .rst_ni, .write_i(write), .data_i(record_in), .full_o(full), .pop_i(pop), .valid_o(waiting),
    .data_o(record_out), .level_o(level)
  );

  takt_pkg::record_t record;
  assign record.payload         = record_out[RecordW-1-:32];
  assign record.stamp           = 64'(record_out[28+:StampW]);
  assign record.sequence_number = record_out[27:12];
  assign record.flags           = record_out[11:8];
  assign record.channel         = record_out[7:4];
  assign record.version         = takt_pkg::WireVersion;
  assign record.kind            = record_out[3:0];

  // To the host.
  logic [23:0] ticks_q;
  logic tx_valid, tx_mark, tx_ready, tx_start, rx_start, rx_valid, rx_error;
  logic [7:0] tx_byte, rx_byte;
  takt_framer framer (
    .clk_i, .rst_ni, .valid_i(waiting), .record_i(record), .pop_o(pop), .delay_i(ticks_q),
    .byte_valid_o(tx_valid), .byte_o(tx_byte), .byte_mark_o(tx_mark), .byte_ready_i(tx_ready)
  );
  generate
    if (Spi) begin : gen_spi
      takt_spi spi (
        .clk_i, .rst_ni, .sclk_i(spi_sclk_i), .cs_ni(spi_cs_ni), .mosi_i(spi_mosi_i), .miso_o(spi_miso_o),
        .miso_enable_o(spi_miso_enable_o), .tx_valid_i(tx_valid), .tx_byte_i(tx_byte), .tx_mark_i(tx_mark),
        .tx_ready_o(tx_ready), .tx_start_o(tx_start), .rx_start_o(rx_start), .rx_valid_o(rx_valid), .rx_byte_o(rx_byte)
      );
      assign uart_tx_o = 1'b1;
      assign rx_error  = 1'b0;
    end else begin : gen_uart
      logic rx_level, rx_rise, rx_fall, rx_tick;
      takt_uart_tx #(.ClocksPerBit(ClocksPerBit)) tx (
        .clk_i, .rst_ni, .valid_i(tx_valid), .byte_i(tx_byte), .mark_i(tx_mark), .ready_o(tx_ready), .start_o(tx_start),
        .pin_o(uart_tx_o)
      );
      takt_sync #(.IdleLevel(1'b1)) rx_sync (
        .clk_i, .rst_ni, .pin_i(uart_rx_i), .invert_i(1'b0), .level_o(rx_level), .rise_o(rx_rise), .fall_o(rx_fall)
      );
      takt_uart_rx #(.TimerW($clog2(ClocksPerBit) + 1)) rx (
        .clk_i, .rst_ni, .clocks_per_bit_i(($clog2(ClocksPerBit) + 1)'(ClocksPerBit)), .level_i(rx_level), .fall_i(rx_fall),
        .start_o(rx_start), .valid_o(rx_valid), .byte_o(rx_byte), .error_o(rx_error), .tick_o(rx_tick)
      );
      assign spi_miso_o        = 1'b0;
      assign spi_miso_enable_o = 1'b0;
    end
  endgenerate

  // From the host.
  logic command, request_start, busy_q, late_q;
  logic [3:0] version, operation;
  logic [31:0] value;
  takt_command #(.Diagnostics(Diagnostics)) commands (
    .clk_i, .rst_ni, .byte_start_i(rx_start), .byte_valid_i(rx_valid), .byte_i(rx_byte), .busy_i(busy_q),
    .valid_o(command), .version_o(version), .operation_o(operation), .address_o(address), .token_o(token), .value_o(value),
    .request_start_o(request_start), .broken_o(broken), .refused_o(refused)
  );
  takt_registers #(
    .Triggers(Triggers), .TriggerW(TriggerW), .ClockHz(ClockHz), .Features(Features), .GnssBit(16'(ClockHz / GnssBaud))
  ) registers (
    .clk_i, .rst_ni, .valid_i(command), .version_i(version), .operation_i(operation), .address_i(address), .value_i(value),
    .late_i(late_q), .answer_o(answer), .is_exchange_o(is_exchange), .status_o(status), .payload_o(answer_payload), .enable_o(enable),
    .invert_o(invert), .gnss_bit_o(gnss_bit), .run_o(run), .last_o(last), .rise_o(rise), .fall_o(fall)
  );

  // A command is under way until its answer is in the FIFO, and a time exchange until its frame is out, because the time
  // that the device took is told in it. Where the answer was dropped the host asks again.
  logic exchange_out;
  assign exchange_out = pop & (record.kind == takt_pkg::Exchange);
  always_ff @(posedge clk_i) begin
    if (!rst_ni) busy_q <= 1'b0;
    else if (command) busy_q <= 1'b1;
    else if ((take[Answer] & (drop | ~answer_exchange)) | exchange_out) busy_q <= 1'b0;
  end

  // One count of ticks for a time exchange: from the request's first bit to the answer's stamp, kept as the age, and from
  // there to the first bit of the answer's frame. The delays make each span exact: the count starts two clocks after the
  // request and is read two clocks after the answer, three clocks pass until it runs again, and so at the frame's start.
  logic clear_q, answer1_q, answer2_q, start1_q, start2_q, start3_q, frozen_q;
  always_ff @(posedge clk_i) begin
    clear_q   <= request_start;
    answer1_q <= answer & rst_ni;
    answer2_q <= answer1_q & rst_ni;
    start1_q  <= tx_start & rst_ni;
    start2_q  <= start1_q & rst_ni;
    start3_q  <= start2_q & rst_ni;
    if (answer2_q) age_q <= ticks_q[15:0];
    if (clear_q || answer2_q) ticks_q <= '0;
    // The top bit stops the count: so late is never an answer.
    else if (!(frozen_q || start3_q || ticks_q[23])) ticks_q <= ticks_q + 1'b1;
    if (!rst_ni || clear_q || answer2_q) frozen_q <= 1'b0;
    else if (start3_q) frozen_q <= 1'b1;
    if (clear_q) late_q <= 1'b0;
    else if (&ticks_q[15:2]) late_q <= 1'b1;
  end

  // What the status word of the heartbeat tells.
  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      loss_q        <= 1'b0;
      high_water_q  <= '0;
      uart_errors_q <= '0;
    end else begin
      loss_q <= (|take & drop) | (loss_q & ~beat);
      if (Diagnostics && level[FifoLog2:FifoLog2-7] > high_water_q) high_water_q <= level[FifoLog2:FifoLog2-7];
      if (Diagnostics) uart_errors_q <= uart_errors_q + 8'(rx_error);
    end
  end
endmodule
