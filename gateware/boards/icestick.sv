// SPDX-License-Identifier: Apache-2.0
// iCEstick (iCE40 HX1K-TQ144), reduced: one IMU, one camera, one trigger without phase, a counter of 32 bits, the pulse
// and the start of the receiver's messages without their text. 12 MHz to 48 MHz, host on the stick's own USB at 3 Mbaud.
module icestick (
  input  logic       clk_12mhz_i,
  input  logic       uart_rx_i,
  output logic       uart_tx_o,
  input  logic       pps_i,
  input  logic       gnss_rx_i,
  input  logic       imu_ready_i,
  input  logic       exposure_i,
  output logic       trigger_o,
  output logic       led_pulse_o
);
  logic clk, locked, rst_n;
  SB_PLL40_CORE #(
    .FEEDBACK_PATH("SIMPLE"), .DIVR(4'd0), .DIVF(7'd63), .DIVQ(3'd4), .FILTER_RANGE(3'd1)
  ) pll (
    .REFERENCECLK(clk_12mhz_i), .PLLOUTGLOBAL(clk), .LOCK(locked), .RESETB(1'b1), .BYPASS(1'b0)
  );
  takt_reset reset (.clk_i(clk), .locked_i(locked), .rst_no(rst_n));

  takt_device #(
    .ClockHz(48_000_000), .StampW(32), .Imus(1), .Cameras(1), .Triggers(1), .TriggerW(24), .TriggerPhase(1'b0), .Gnss(1'b1), .GnssText(1'b0),
    .FrameW(8), .Diagnostics(1'b0),
    .ClocksPerBit(16)
  ) device (
    .clk_i(clk), .rst_ni(rst_n), .pps_i, .gnss_rx_i, .imu_ready_i, .exposure_i, .trigger_o, .uart_rx_i, .uart_tx_o,
    .spi_sclk_i(1'b0), .spi_cs_ni(1'b1), .spi_mosi_i(1'b0), .spi_miso_o(), .spi_miso_enable_o()
  );
  assign led_pulse_o = pps_i;
endmodule
