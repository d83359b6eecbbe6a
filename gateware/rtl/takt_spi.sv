// SPDX-License-Identifier: Apache-2.0
// SPI slave, mode 0, most significant bit first; SCLK at most an eighth of the clock. Both directions carry the bytes that
// a UART would; where there is none to send the host reads 0, which no frame begins with, and a host that has nothing to
// say sends 0 too.
// A byte is not given away before the host has clocked its first bit: one that was only prepared is kept.
module takt_spi (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic       sclk_i,
  input  logic       cs_ni,
  input  logic       mosi_i,
  output logic       miso_o,
  output logic       miso_enable_o,
  input  logic       tx_valid_i,
  input  logic [7:0] tx_byte_i,
  input  logic       tx_mark_i,
  output logic       tx_ready_o,
  output logic       tx_start_o,
  output logic       rx_start_o,
  output logic       rx_valid_o,
  output logic [7:0] rx_byte_o
);
  logic sclk, sclk_rise, sclk_fall, cs_n, cs_rise, cs_fall;
  logic mosi_meta_q, mosi_q;

  takt_sync sync_sclk (
    .clk_i, .rst_ni, .pin_i(sclk_i), .invert_i(1'b0), .level_o(sclk), .rise_o(sclk_rise), .fall_o(sclk_fall)
  );
  takt_sync #(.IdleLevel(1'b1)) sync_cs (
    .clk_i, .rst_ni, .pin_i(cs_ni), .invert_i(1'b0), .level_o(cs_n), .rise_o(cs_rise), .fall_o(cs_fall)
  );

  logic [2:0] bit_q;
  logic [7:0] out_q, in_q;
  logic real_q, mark_q, prepare_q, valid_q;
  logic first;

  assign first = sclk_rise & ~cs_n & (bit_q == 3'd0);

  always_ff @(posedge clk_i) begin
    mosi_meta_q <= mosi_i;
    mosi_q      <= mosi_meta_q;
    valid_q     <= 1'b0;
    if (!rst_ni || cs_n) begin
      bit_q     <= '0;
      real_q    <= 1'b0;
      prepare_q <= 1'b1;
    end else begin
      if (prepare_q) begin
        // Before the first bit of a byte: after CS fell, or after the last bit of the byte before.
        out_q     <= tx_valid_i ? tx_byte_i : 8'h00;
        real_q    <= tx_valid_i;
        mark_q    <= tx_mark_i;
        prepare_q <= 1'b0;
      end
      if (sclk_rise) begin
        in_q    <= {in_q[6:0], mosi_q};
        bit_q   <= bit_q + 1'b1;
        valid_q <= bit_q == 3'd7;
        if (bit_q == 3'd0) real_q <= 1'b0;
      end
      if (sclk_fall) begin
        if (bit_q == 3'd0) prepare_q <= 1'b1;
        else out_q <= {out_q[6:0], 1'b0};
      end
    end
  end

  assign miso_o        = out_q[7];
  assign miso_enable_o = ~cs_n;
  assign tx_ready_o    = first & real_q;
  assign tx_start_o    = first & real_q & mark_q;
  assign rx_start_o    = first;
  assign rx_valid_o    = valid_q;
  assign rx_byte_o     = in_q;
endmodule
