// SPDX-License-Identifier: Apache-2.0
// The device of the iCEstick with a quicker heartbeat, for the netlist's benches.
module reduced (
  input  logic clk_i,
  input  logic rst_ni,
  input  logic pps_i,
  input  logic gnss_rx_i,
  input  logic imu_ready_i,
  input  logic exposure_i,
  output logic trigger_o,
  input  logic uart_rx_i,
  output logic uart_tx_o,
  input  logic spi_sclk_i,
  input  logic spi_cs_ni,
  input  logic spi_mosi_i,
  output logic spi_miso_o,
  output logic spi_miso_enable_o
);
  takt_device #(
    .StampW(32), .Imus(1), .Cameras(1), .Triggers(1), .TriggerW(24), .TriggerPhase(1'b0), .Gnss(1'b1), .GnssText(1'b0),
    .FrameW(8), .Diagnostics(1'b0), .HeartbeatLog2(16)
  ) device (
    .clk_i, .rst_ni, .pps_i, .gnss_rx_i, .imu_ready_i, .exposure_i, .trigger_o, .uart_rx_i, .uart_tx_o, .spi_sclk_i,
    .spi_cs_ni, .spi_mosi_i, .spi_miso_o, .spi_miso_enable_o
  );
endmodule
