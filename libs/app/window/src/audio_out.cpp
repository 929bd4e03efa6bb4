#include "audio_out.h"

#include <SDL.h>
#include <dlfcn.h>

#include "osteo/core/base/error.h"
#include "osteo/simulation/sound/synthesizer.h"

namespace osteo::inline app {
namespace {

// While a card is looked for: where there is none, ALSA's library writes a dozen lines on standard error, and we say it
// in one.
class QuietAlsa {
 public:
  using Handler = void (*)(const char* file, int line, const char* function, int error, const char* format, ...);
  QuietAlsa() : set_(reinterpret_cast<int (*)(Handler)>(::dlsym(RTLD_DEFAULT, "snd_lib_error_set_handler"))) {
    if (set_ != nullptr) set_(say_nothing);
  }
  ~QuietAlsa() {
    if (set_ != nullptr) set_(nullptr);
  }
  QuietAlsa(const QuietAlsa&) = delete;
  QuietAlsa& operator=(const QuietAlsa&) = delete;

 private:
  static void say_nothing(const char*, int, const char*, int, const char*, ...) {}
  int (*set_)(Handler);
};

}  // namespace

AudioOut::AudioOut(std::function<void(std::span<float>)> fill) : fill_(std::move(fill)) {
  const QuietAlsa quiet;
  SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");  // Ctrl-C is ours
  SDL_SetHint(SDL_HINT_AUDIO_DEVICE_APP_NAME, "Osteotome");
  if (SDL_InitSubSystem(SDL_INIT_AUDIO) != 0)
    throw Error(ExitCode::failed, std::string("there is no sound: ") + SDL_GetError());
  SDL_AudioSpec wanted{}, got{};
  wanted.freq = Synthesizer::kRateHz;
  wanted.format = AUDIO_F32SYS;
  wanted.channels = 1;
  wanted.samples = kSamples;
  wanted.userdata = this;
  wanted.callback = [](void* self, Uint8* bytes, int length) {
    static_cast<AudioOut*>(self)->fill_(
        {reinterpret_cast<float*>(bytes), static_cast<std::size_t>(length) / sizeof(float)});
  };
  device_ = SDL_OpenAudioDevice(nullptr, 0, &wanted, &got, 0);
  if (device_ == 0) {
    const std::string why = SDL_GetError();
    SDL_QuitSubSystem(SDL_INIT_AUDIO);
    throw Error(ExitCode::failed, "there is no sound: " + why);
  }
  const char* const driver = SDL_GetCurrentAudioDriver();
  driver_ = driver == nullptr ? "" : driver;
  buffer_s_ = static_cast<double>(got.samples) / got.freq;
  SDL_PauseAudioDevice(device_, 0);
}

AudioOut::~AudioOut() {
  SDL_CloseAudioDevice(device_);
  SDL_QuitSubSystem(SDL_INIT_AUDIO);
}

AudioOut::Pause::Pause(AudioOut& out) : out_(out) {
  SDL_LockAudioDevice(out_.device_);
}
AudioOut::Pause::~Pause() {
  SDL_UnlockAudioDevice(out_.device_);
}

}  // namespace osteo::inline app
