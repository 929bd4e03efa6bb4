#include "osteo/assessment/movie/movie_file.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavcodec/bsf.h>
#include <libavformat/avformat.h>
#include <libavutil/imgutils.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>
}

#include <array>
#include <string_view>
#include <utility>

#include "osteo/core/base/error.h"

namespace osteo::inline assessment {
namespace {

std::string words_of(int code) {
  std::array<char, AV_ERROR_MAX_STRING_SIZE> text{};
  av_strerror(code, text.data(), text.size());
  return text.data();
}

Error cannot_write(const std::filesystem::path& path, int code) {
  return {ExitCode::cannot_write,
          "the movie cannot be written to '" + path.filename().string() + "': " + words_of(code),
          "make room on the disk, or write somewhere else"};
}

// libav talks to standard error by itself; what matters comes back as a code.
void be_quiet() {
  av_log_set_level(AV_LOG_QUIET);
}

const AVCodec* encoder_for(std::string_view ending) {
  be_quiet();
  if (ending == ".webm") return avcodec_find_encoder_by_name("libvpx-vp9");
  for (const char* const name : {"libx264", "libopenh264"}) {
    if (const AVCodec* const codec = avcodec_find_encoder_by_name(name)) return codec;
  }
  return nullptr;
}

}  // namespace

struct MovieFile::Impl {
  std::filesystem::path path;
  AVFormatContext* format = nullptr;
  AVCodecContext* codec = nullptr;
  AVBSFContext* filter = nullptr;
  AVStream* stream = nullptr;
  AVFrame* frame = nullptr;
  AVPacket* packet = nullptr;
  SwsContext* to_yuv = nullptr;
  std::string encoder;
  std::uint64_t frames = 0;
  bool ended = false;

  ~Impl() {
    sws_freeContext(to_yuv);
    av_packet_free(&packet);
    av_frame_free(&frame);
    av_bsf_free(&filter);
    avcodec_free_context(&codec);
    if (format != nullptr && format->pb != nullptr) avio_closep(&format->pb);
    avformat_free_context(format);
  }

  void check(int code) const {
    if (code < 0) throw cannot_write(path, code);
  }

  void write_packet() {
    packet->stream_index = stream->index;
    packet->duration = 1;
    av_packet_rescale_ts(packet, codec->time_base, stream->time_base);
    check(av_interleaved_write_frame(format, packet));
    check(format->pb->error);
  }

  // What the encoder has ready; with `given` null all that is left.
  void encode(const AVFrame* given) {
    check(avcodec_send_frame(codec, given));
    for (;;) {
      const int code = avcodec_receive_packet(codec, packet);
      if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) break;
      check(code);
      if (filter == nullptr) {
        write_packet();
        continue;
      }
      check(av_bsf_send_packet(filter, packet));
      while (av_bsf_receive_packet(filter, packet) == 0) write_packet();
    }
  }
};

MovieFile::MovieFile(const std::filesystem::path& path, int width, int height, int fps)
    : impl_(std::make_unique<Impl>()) {
  be_quiet();
  Impl& m = *impl_;
  m.path = path;
  const std::string ending = path.extension().string();
  if (ending != ".mp4" && ending != ".webm")
    throw Error(ExitCode::usage, "'" + path.filename().string() + "' is no movie that can be written",
                "name it NAME.mp4 or NAME.webm");
  const auto fits = [](int edge) { return edge >= kMinEdge && edge <= kMaxEdge && edge % 2 == 0; };
  if (!fits(width) || !fits(height))
    throw Error(ExitCode::usage,
                "a movie of " + std::to_string(width) + "x" + std::to_string(height) + " pixels cannot be made",
                "give even numbers from " + std::to_string(kMinEdge) + " to " + std::to_string(kMaxEdge) +
                    ", such as 1280x720");
  if (fps < 1 || fps > kMaxFps)
    throw Error(ExitCode::usage, std::to_string(fps) + " frames a second cannot be made",
                "give 1 to " + std::to_string(kMaxFps));
  const AVCodec* const encoder = encoder_for(ending);
  if (encoder == nullptr)
    throw Error(ExitCode::failed, "this machine's libav has no encoder for " + ending,
                ending == ".mp4"
                    ? "install one with libx264 or libopenh264 (Debian's libavcodec has it), or write a .webm"
                    : "install one with libvpx (Debian's libavcodec has it), or write a .mp4");
  m.encoder = encoder->name;
  const bool x264 = m.encoder == "libx264", vp9 = ending == ".webm";

  m.check(avformat_alloc_output_context2(&m.format, nullptr, vp9 ? "webm" : "mp4", path.c_str()));
  m.format->flags |= AVFMT_FLAG_BITEXACT;  // neither the date nor a word on what wrote it
  m.stream = avformat_new_stream(m.format, nullptr);
  m.codec = avcodec_alloc_context3(encoder);
  m.frame = av_frame_alloc();
  m.packet = av_packet_alloc();
  if (m.stream == nullptr || m.codec == nullptr || m.frame == nullptr || m.packet == nullptr)
    throw Error(ExitCode::resources, "no memory for the movie");
  AVCodecContext& c = *m.codec;
  c.width = width;
  c.height = height;
  c.time_base = {1, fps};
  c.framerate = {fps, 1};
  c.gop_size = 2 * fps;  // so far apart at most are places to jump to
  c.pix_fmt = AV_PIX_FMT_YUV420P;
  c.color_range = AVCOL_RANGE_MPEG;
  c.colorspace = AVCOL_SPC_BT709;
  c.color_primaries = AVCOL_PRI_BT709;
  c.color_trc = AVCOL_TRC_BT709;
  c.thread_count = 1;
  c.flags |= AV_CODEC_FLAG_BITEXACT;
  if ((m.format->oformat->flags & AVFMT_GLOBALHEADER) != 0) c.flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
  if (x264) {
    av_opt_set(c.priv_data, "preset", "veryfast", 0);
    av_opt_set(c.priv_data, "crf", "20", 0);
  } else if (vp9) {
    av_opt_set(c.priv_data, "crf", "30", 0);
    c.bit_rate = 0;
    av_opt_set(c.priv_data, "deadline", "realtime", 0);
    av_opt_set(c.priv_data, "cpu-used", "6", 0);
  } else {
    c.bit_rate = static_cast<std::int64_t>(width) * height * fps / 10;
  }
  if (const int code = avcodec_open2(m.codec, encoder, nullptr); code < 0)
    throw Error(ExitCode::failed,
                m.encoder + " does not take pictures of " + std::to_string(width) + "x" + std::to_string(height) +
                    ": " + words_of(code),
                "choose another size");
  m.check(avcodec_parameters_from_context(m.stream->codecpar, m.codec));
  m.stream->time_base = c.time_base;
  m.stream->avg_frame_rate = c.framerate;
  if (!vp9) {
    // Encoders write their name and settings into the pictures' stream (SEI, unit 6): they are taken out again.
    const AVBitStreamFilter* const kind = av_bsf_get_by_name("filter_units");
    if (kind == nullptr)
      throw Error(ExitCode::failed, "this machine's libav has no 'filter_units'", "install Debian's libavcodec");
    m.check(av_bsf_alloc(kind, &m.filter));
    av_opt_set(m.filter->priv_data, "remove_types", "6", 0);
    m.check(avcodec_parameters_copy(m.filter->par_in, m.stream->codecpar));
    m.filter->time_base_in = c.time_base;
    m.check(av_bsf_init(m.filter));
    m.check(avcodec_parameters_copy(m.stream->codecpar, m.filter->par_out));
  }

  m.frame->format = c.pix_fmt;
  m.frame->width = width;
  m.frame->height = height;
  m.check(av_frame_get_buffer(m.frame, 0));
  m.to_yuv = sws_getContext(width, height, AV_PIX_FMT_RGB24, width, height, c.pix_fmt,
                            SWS_BICUBIC | SWS_ACCURATE_RND | SWS_BITEXACT, nullptr, nullptr, nullptr);
  if (m.to_yuv == nullptr) throw Error(ExitCode::resources, "no memory for the movie");
  sws_setColorspaceDetails(m.to_yuv, sws_getCoefficients(SWS_CS_DEFAULT), 1, sws_getCoefficients(SWS_CS_ITU709), 0, 0,
                           1 << 16, 1 << 16);

  m.check(avio_open(&m.format->pb, path.c_str(), AVIO_FLAG_WRITE));
  AVDictionary* options = nullptr;
  if (!vp9) av_dict_set(&options, "movflags", "+faststart", 0);
  const int code = avformat_write_header(m.format, &options);
  av_dict_free(&options);
  m.check(code);
}

MovieFile::~MovieFile() = default;

void MovieFile::add(const Picture& picture) {
  Impl& m = *impl_;
  if (picture.width != m.codec->width || picture.height != m.codec->height)
    throw Error(ExitCode::unspecified, "a picture of another size than the movie's");
  m.check(av_frame_make_writable(m.frame));
  const std::uint8_t* const rows[] = {picture.rgb.data()};
  const int strides[] = {3 * picture.width};
  sws_scale(m.to_yuv, rows, strides, 0, picture.height, m.frame->data, m.frame->linesize);
  m.frame->pts = static_cast<std::int64_t>(m.frames++);
  m.encode(m.frame);
}

void MovieFile::finish() {
  Impl& m = *impl_;
  if (std::exchange(m.ended, true)) return;
  m.encode(nullptr);
  m.check(av_write_trailer(m.format));
  m.check(avio_closep(&m.format->pb));
  const MovieFileFacts facts = read_movie_facts(m.path);
  if (facts.frames != m.frames || facts.width != m.codec->width || facts.height != m.codec->height)
    throw Error(ExitCode::failed,
                "the movie reads back with " + std::to_string(facts.frames) + " frames of " + std::to_string(m.frames));
}

std::uint64_t MovieFile::frames() const {
  return impl_->frames;
}

const std::string& MovieFile::encoder() const {
  return impl_->encoder;
}

MovieFileFacts read_movie_facts(const std::filesystem::path& path) {
  be_quiet();
  if (!std::filesystem::exists(path)) throw Error(ExitCode::no_input, "'" + path.string() + "' does not exist");
  AVFormatContext* format = nullptr;
  const auto corrupt = [&](const std::string& why) {
    avformat_close_input(&format);
    return Error(ExitCode::corrupt, "'" + path.filename().string() + "' cannot be read as a movie: " + why);
  };
  if (const int code = avformat_open_input(&format, path.c_str(), nullptr, nullptr); code < 0)
    throw corrupt(words_of(code));
  if (const int code = avformat_find_stream_info(format, nullptr); code < 0) throw corrupt(words_of(code));
  const int number = av_find_best_stream(format, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (number < 0) throw corrupt("it has no pictures");
  MovieFileFacts facts;
  const AVStream& s = *format->streams[number];
  facts.width = s.codecpar->width;
  facts.height = s.codecpar->height;
  facts.codec = avcodec_get_name(s.codecpar->codec_id);
  // What every file of the kind says: its brand, and that a handler is one.
  const auto count_tags = [&](const AVDictionary* tags) {
    const AVDictionaryEntry* tag = nullptr;
    while ((tag = av_dict_get(tags, "", tag, AV_DICT_IGNORE_SUFFIX)) != nullptr) {
      const std::string_view key = tag->key, value = tag->value;
      const bool of_format = key == "major_brand" || key == "minor_version" || key == "compatible_brands" ||
                             key == "vendor_id" || (key == "language" && value == "und") ||
                             (key == "handler_name" && value == "VideoHandler") || key == "DURATION" ||
                             ((key == "ENCODER" || key == "encoder") && value == "Lavf");
      if (!of_format) ++facts.tags;
    }
  };
  count_tags(format->metadata);
  count_tags(s.metadata);
  AVPacket* packet = av_packet_alloc();
  std::int64_t end = 0;
  while (av_read_frame(format, packet) >= 0) {
    if (packet->stream_index == number) {
      ++facts.frames;
      end = std::max(end, packet->pts + packet->duration);
    }
    av_packet_unref(packet);
  }
  av_packet_free(&packet);
  facts.seconds = static_cast<double>(end) * av_q2d(s.time_base);
  avformat_close_input(&format);
  return facts;
}

std::string movie_encoder_licence() {
  return avcodec_license();
}

}  // namespace osteo::inline assessment
