// How loud and how high drilling sounds: the model's tables, apart from how samples are made of them.
#pragma once
#include <array>
#include <cstdint>
#include <span>

namespace osteo::inline simulation {

enum class SoundKind : std::uint8_t { silent, burr, sucker, irrigator };

/// What one instrument does, as far as it is heard. Numbers outside their ranges are taken as the nearest inside; what
/// is not finite as 0.
struct SoundVoice {
  SoundKind kind = SoundKind::silent;
  double speed_rpm = 0;     ///< burr: 0 to 200,000
  double diameter_mm = 4;   ///< burr: 0.5 to 10; sucker: of its bore's outside, 1 to 5
  double press_n = 0;       ///< burr on bone, 0 to 20; 0: it runs free
  double thickness_mm = 0;  ///< of the bone under it, 0 to 10; 0: not known, taken as thick
  double softness = 0;      ///< 0 to 1: how near sinus, dura or a vessel is under the burr
  double draws = 0;         ///< sucker, irrigator: 0 off, 1 on
  double edge_db = 0;       ///< burr: of its kind on bone, against a cutting burr, -60 to 20
  /// Burr: of its sound power on bone what is in the lines of its teeth, 0 to 1; the rest is noise. 0: it has none, as
  /// a diamond.
  double teeth_share = 0.5;

  friend bool operator==(const SoundVoice&, const SoundVoice&) = default;
};

enum class SoundAlarm : std::uint8_t { none, touched, injured };

/// All that is heard follows from the sequence of these.
struct SoundState {
  static constexpr std::size_t kMaxVoices = 4;
  std::array<SoundVoice, kMaxVoices> voices;
  double water = 0;    ///< 0 to 1: the share of what a sucker draws that is water
  double metal_n = 0;  ///< with which a plate meets bone, or two instruments each other; each beginning of it is heard
  SoundAlarm alarm = SoundAlarm::none;

  friend bool operator==(const SoundState&, const SoundState&) = default;
};

/// The model's constants. Levels are dB at the surgeon's ear; where publications measure in the patient's ear or at the
/// bone, only their differences are taken. `designed`: chosen for the ear, no measurement was found.
struct SoundModel {
  /// A root mean square of 1 in samples. What comes out of a loudspeaker depends on it and on the volume: see
  /// SafeLevel.
  double full_scale_db = 105;

  // Burr on bone. Level of a 6 mm cutting burr at 1 N and 60,000 rpm: designed, between the 65 and 96 dBA that were
  // measured in air in the ear canal while drilling (Arch. Otolaryngol. 106:92, 1980).
  double contact_db = 80;
  /// By diameter, in mm, against 6 mm; linear between: 4 mm -1 to -6, 2 mm -5 to -16 dB (Kylen 1977), their middles.
  std::array<std::array<double, 2>, 4> size_db{{{2, -10.5}, {4, -3.5}, {6, 0}, {7, 1.75}}};
  double speed_db =
      5;  ///< from 20,000 to 80,000 rpm, by the logarithm: 0 to 5 dB (Kylen 1977). Below: falls by 40 dB a decade
  double press_db_per_decade = 10;  ///< designed; from 0.01 N (-20 dB) to 5 N (+7 dB)
  double free_db = 58;              ///< running free: designed
  int teeth = 8;                    ///< flutes of a cutting burr, which have 6 to 12
  /// The frequencies rise by this share where the bone is thin, from thin_mm to nothing (D. Morris 2006, section 3.2.9
  /// lets the pitch rise; no measured value was found): designed.
  double thin_pitch = 0.25, thin_mm = 2;
  double press_pitch_per_n = -0.008;  ///< and fall under load, up to 5 N: designed
  double soft_db = -12;               ///< above 4 kHz, falling from 2 kHz, where softness is 1: designed

  // Sucker, dry, of 2.7 mm (8 Fr). 3 to 7 Fr gave 68 to 97 dB in the ear canal, larger and wetter ones more; designed
  // for the surgeon's ear.
  double suction_db = 62;
  double suction_db_per_mm = 4.5, suction_wet_db = 8;
  double gurgles_per_s = 14;  ///< at half water, none at 0 and 1: designed
  double irrigation_db = 50;  ///< designed
  double metal_db = 66, alarm_db = 70;
};

/// A line of the spectrum: `multiple` times the burr's rotation.
struct SoundLine {
  double hz = 0;
  double db = -200;
};
/// What a burr's voice is made of.
struct BurrSpectrum {
  static constexpr std::size_t kRotationLines = 2, kToothLines = 4, kLines = kRotationLines + kToothLines;
  double rotation_hz = 0;               ///< with the pitch of load and thinness in it
  std::array<SoundLine, kLines> lines;  ///< rotation x 1, 2; rotation x teeth x 1, 2, 3, 4. None above 18 kHz
  double noise_db = -200;
  double softness = 0;  ///< how dull the noise is
};
[[nodiscard]] BurrSpectrum burr_spectrum(const SoundVoice& voice, const SoundModel& model) noexcept;
/// Of a sucker that is on, its noise; -200 when it is off.
[[nodiscard]] double suction_db(const SoundVoice& voice, double water, const SoundModel& model) noexcept;
/// The weight of a burr's sound at a frequency: 0 from 2 to 4 kHz, at least -24 dB at 8 and -60 at 16 kHz; measured
/// near burrs, where the most lay at 4 kHz and 24 dB less at 8, 68 at 16.
[[nodiscard]] double envelope_db(double hz) noexcept;

}  // namespace osteo::inline simulation
