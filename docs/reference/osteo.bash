# bash completion of osteo: source it, or put it into /etc/bash_completion.d
_osteo() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]}
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "import import-bone crop denoise reduce-metal threshold apply-edits resample surface mesh-info mesh-repair compare distance distance-at voxelize tetrahedralize embed-surface bone-stiffness fem calibrate simulate fit-damping saw separate-fragments virtual-fixture snapshot structures tube find-structures segment-network register plan-reconstruction phantom list info list-series suggest-threshold convert run prepare batch report approve edit export-slicer import-slicer estimate-cost export-result rehearse replay playback tutor join score movie goal-cavity review export sound heat nerve-monitor stream nerve-console experiment ground-truth study simulate-trainee devices markers calibrate-camera calibrate-pen track-pen deidentify send fetch receive watch-folder doctor demo bench docs help --version" -- "$cur"))
    return
  fi
  case "${COMP_WORDS[1]} $prev" in
    "crop --region") COMPREPLY=($(compgen -W "whole box left_temporal right_temporal jaw " -- "$cur")); return ;;
    "threshold --preset") COMPREPLY=($(compgen -W "fixed cortical cellular thin " -- "$cur")); return ;;
    "threshold --connectivity") COMPREPLY=($(compgen -W "face full " -- "$cur")); return ;;
    "resample --between") COMPREPLY=($(compgen -W "automatic values outlines " -- "$cur")); return ;;
    "surface --method") COMPREPLY=($(compgen -W "nets voxel " -- "$cur")); return ;;
    "distance --region") COMPREPLY=($(compgen -W "box interior band " -- "$cur")); return ;;
    "distance --method") COMPREPLY=($(compgen -W "exact swept thesis " -- "$cur")); return ;;
    "voxelize --margin") COMPREPLY=($(compgen -W "exact thesis " -- "$cur")); return ;;
    "tetrahedralize --method") COMPREPLY=($(compgen -W "grid grid-conforming graded tetgen cgal " -- "$cur")); return ;;
    "embed-surface --method") COMPREPLY=($(compgen -W "embedded frames " -- "$cur")); return ;;
    "bone-stiffness --law") COMPREPLY=($(compgen -W "morgan_2003 keller_1994 carter_hayes_1977 keyak_1998 " -- "$cur")); return ;;
    "bone-stiffness --weight") COMPREPLY=($(compgen -W "apparent in_situ " -- "$cur")); return ;;
    "bone-stiffness --order") COMPREPLY=($(compgen -W "auto t4 t10 t4_mean " -- "$cur")); return ;;
    "fem --law") COMPREPLY=($(compgen -W "auto linear stvk neo_hooke neo_hooke_split corotated " -- "$cur")); return ;;
    "fem --order") COMPREPLY=($(compgen -W "auto t4 t10 t4_mean " -- "$cur")); return ;;
    "calibrate --law") COMPREPLY=($(compgen -W "auto linear stvk neo_hooke neo_hooke_split corotated " -- "$cur")); return ;;
    "calibrate --order") COMPREPLY=($(compgen -W "auto t4 t10 t4_mean " -- "$cur")); return ;;
    "simulate --method") COMPREPLY=($(compgen -W "explicit implicit " -- "$cur")); return ;;
    "fit-damping --method") COMPREPLY=($(compgen -W "explicit implicit " -- "$cur")); return ;;
    "separate-fragments --connectivity") COMPREPLY=($(compgen -W "face full " -- "$cur")); return ;;
    "snapshot --view") COMPREPLY=($(compgen -W "left_front left right front back above below " -- "$cur")); return ;;
    "tube --kind") COMPREPLY=($(compgen -W "nerve vessel " -- "$cur")); return ;;
    "find-structures --side") COMPREPLY=($(compgen -W "left right " -- "$cur")); return ;;
    "register --method") COMPREPLY=($(compgen -W "mutual surface " -- "$cur")); return ;;
    "plan-reconstruction --target") COMPREPLY=($(compgen -W "mirrored own " -- "$cur")); return ;;
    "phantom --region") COMPREPLY=($(compgen -W "head temporal mandible " -- "$cur")); return ;;
    "run --engine") COMPREPLY=($(compgen -W "stages vtk " -- "$cur")); return ;;
    "prepare --preset") COMPREPLY=($(compgen -W "fixed cortical cellular thin " -- "$cur")); return ;;
    "prepare --region") COMPREPLY=($(compgen -W "whole box left_temporal right_temporal jaw " -- "$cur")); return ;;
    "estimate-cost --contact") COMPREPLY=($(compgen -W "rays volume overlap proxy " -- "$cur")); return ;;
    "rehearse --burr") COMPREPLY=($(compgen -W "cutting diamond " -- "$cur")); return ;;
    "rehearse --shape") COMPREPLY=($(compgen -W "ball cylinder taper " -- "$cur")); return ;;
    "rehearse --contact") COMPREPLY=($(compgen -W "rays volume overlap proxy " -- "$cur")); return ;;
    "rehearse --device") COMPREPLY=($(compgen -W "auto mouse spacemouse woodenhaptics marker igtl " -- "$cur")); return ;;
    "rehearse --camera-place") COMPREPLY=($(compgen -W "facing above behind " -- "$cur")); return ;;
    "rehearse --second-device") COMPREPLY=($(compgen -W "keys spacemouse woodenhaptics " -- "$cur")); return ;;
    "rehearse --position") COMPREPLY=($(compgen -W "supine prone sitting left_side right_side " -- "$cur")); return ;;
    "rehearse --role") COMPREPLY=($(compgen -W "trainee watcher " -- "$cur")); return ;;
    "rehearse --stereo") COMPREPLY=($(compgen -W "off side_by_side top_bottom anaglyph interlaced quad_buffer " -- "$cur")); return ;;
    "rehearse --quality") COMPREPLY=($(compgen -W "auto plain calm deep " -- "$cur")); return ;;
    "rehearse --layout") COMPREPLY=($(compgen -W "last beside operate plan " -- "$cur")); return ;;
    "rehearse --side") COMPREPLY=($(compgen -W "left right " -- "$cur")); return ;;
    "playback --mode") COMPREPLY=($(compgen -W "show feel guide fading amplify graphics " -- "$cur")); return ;;
    "playback --drills") COMPREPLY=($(compgen -W "usual expert learner " -- "$cur")); return ;;
    "playback --pace") COMPREPLY=($(compgen -W "usual clock way " -- "$cur")); return ;;
    "playback --device") COMPREPLY=($(compgen -W "auto mouse spacemouse woodenhaptics marker igtl " -- "$cur")); return ;;
    "join --role") COMPREPLY=($(compgen -W "trainee watcher " -- "$cur")); return ;;
    "movie --camera") COMPREPLY=($(compgen -W "surgeon fixed " -- "$cur")); return ;;
    "markers --paper") COMPREPLY=($(compgen -W "a4 letter " -- "$cur")); return ;;
  esac
  local flags="--threads --force --quiet --json --progress --seed --help"
  case "${COMP_WORDS[1]}" in
    import) flags="$flags --xml --describe --series --stack --max-gap-mm --max-hole-mm --any-modality --hu-offset --axes --verdict-out" ;;
    import-bone) flags="$flags --xml --describe --lower --spacing-mm --min-volume-mm3 --keep-largest --series --stack --max-gap-mm --max-hole-mm --any-modality --hu-offset --hu-out --valid-out --verdict-out" ;;
    crop) flags="$flags --xml --describe --region --centre-mm --size-mm --labels --labels-out" ;;
    denoise) flags="$flags --xml --describe --strength" ;;
    reduce-metal) flags="$flags --xml --describe --metal-hu --min-area-mm2" ;;
    threshold) flags="$flags --xml --describe --preset --lower --upper --core --remove-table --keep-table --metal-mm --metal-hu --metal-lower --close-mm --fill-mm3 --min-volume-mm3 --keep-largest --connectivity" ;;
    apply-edits) flags="$flags --xml --describe --labels --structures-out --edits-out" ;;
    resample) flags="$flags --xml --describe --spacing-mm --lower --between --box-mm --centre-mm --align-mm --hu-out" ;;
    surface) flags="$flags --xml --describe --method --iso" ;;
    mesh-info) flags="$flags --xml --describe --self-intersections" ;;
    mesh-repair) flags="$flags --xml --describe --weld-mm --max-hole-edges --self-intersections --allow-loss --min-body-area-mm2 --keep-largest" ;;
    compare) flags="$flags --xml --describe --iso" ;;
    distance) flags="$flags --xml --describe --region --band-inside-mm --band-outside-mm --spacing-mm --resolution --margin-voxels --method --tree-ascend-n --breadth-first --bound-as-printed --structure --name-nearest --like --nearest-out" ;;
    distance-at) flags="$flags --xml --describe" ;;
    voxelize) flags="$flags --xml --describe --spacing-mm --resolution --margin-voxels --margin --like --grid-out" ;;
    tetrahedralize) flags="$flags --xml --describe --method --spacing-mm --resolution --margin --target-dihedral-deg --keep-thin --levels --surface-spacing-mm --max-volume-mm3 --clean --time-limit-s --memory-limit-gb" ;;
    embed-surface) flags="$flags --xml --describe --method --neighbours" ;;
    bone-stiffness) flags="$flags --xml --describe --law --density-per-1000-hu --density-at-0-hu --ash-correction --weight --min-mpa --max-mpa --step-percent --keep-floating --load --order --map-out --report-out" ;;
    fem) flags="$flags --xml --describe --law --order --load --load-steps --tolerance --report-out --inp-out --nodes-out" ;;
    calibrate) flags="$flags --xml --describe --fit --law --order --grid-x --grid-y --grid-z --shared-grid --blind --pull --smooth --starts --samples --iterations --check-truth --find-pose --max-points --measured --surface --deformed-out --map-out --course-out" ;;
    simulate) flags="$flags --xml --describe --load --method --seconds --density-kg-m3 --damping-per-s --min-step-ms --step-ms --until-rest --tool-radius-mm --tool-from-mm --tool-to-mm --tool-stiffness-n-per-mm --obstacle-stiffness-n-per-mm --constants --obstacle --report-out" ;;
    fit-damping) flags="$flags --xml --describe --load --at-mm --along --method --step-ms --density-kg-m3 --fit-stiffness --release-s --fit-release --constants --fitted-out" ;;
    saw) flags="$flags --xml --describe --at-mm --from-centre --normal --along --kerf-mm --length-mm --depth-mm" ;;
    separate-fragments) flags="$flags --xml --describe --min-volume-mm3 --connectivity --apart-mm --keep --surface-out --kept-out" ;;
    virtual-fixture) flags="$flags --xml --describe --stiffness-n-per-mm --max-force-n --arc-penalty --engage-mm --release-mm" ;;
    snapshot) flags="$flags --xml --describe --width --height --view --bone-hu --centre-mm --title --mask --surface" ;;
    structures) flags="$flags --xml --describe --names --only-named --image" ;;
    tube) flags="$flags --xml --describe --points-mm --name --kind --max-radius-mm --lumen-hu --snap-mm --max-uncertain-mm --points --labels --line-out" ;;
    find-structures) flags="$flags --xml --describe --side --what --labyrinth-mm --min-quality --findings-out" ;;
    segment-network) flags="$flags --xml --describe --folds --mirror --step --max-memory-gb" ;;
    register) flags="$flags --xml --describe --method --finest-mm --bone-hu --max-residual-mm --accept-poor --labels --findings-out --moved-out --labels-out --checkerboard-out" ;;
    plan-reconstruction) flags="$flags --xml --describe --target --a-mm --a-normal --b-mm --b-normal --down --max-segments --min-length-mm --max-contour-mm --kerf-mm --reserve-mm --findings-out" ;;
    phantom) flags="$flags --xml --describe --region --spacing-mm --slice-mm --noise-hu --individual --labels-out" ;;
    list) flags="$flags" ;;
    info) flags="$flags" ;;
    list-series) flags="$flags --studies --thumbnails" ;;
    suggest-threshold) flags="$flags --series --hu-offset --picture" ;;
    convert) flags="$flags --source --series --onto-source --description --segmentation" ;;
    run) flags="$flags --validate --dry-run --reuse --engine" ;;
    prepare) flags="$flags --out --preset --lower --spacing-mm --region --remove-table --keep-table --structures --names --series --axes --hu-offset --pipeline --edits --fresh --no-report" ;;
    batch) flags="$flags --out --pipeline --jobs --memory-mb --minutes --retries --retry-failed --keep-free-mb --only --report-only --no-report" ;;
    report) flags="$flags --scan --dicom --measures --segmentation" ;;
    approve) flags="$flags --by --note --withdraw" ;;
    edit) flags="$flags --apply --scan --width --height --state-file" ;;
    export-slicer) flags="$flags --source" ;;
    import-slicer) flags="$flags --source --match-by-position --check" ;;
    estimate-cost) flags="$flags --settings --contact --dust --heat" ;;
    export-result) flags="$flags --out --case-folder --at-s" ;;
    rehearse) flags="$flags --headless --script --out --burr --diameter-mm --shape --contact --settings --device --tracker --arm --camera --pen --video --camera-place --hand-scale --second-device --second-instrument --dust --heat --position --head-turned-deg --rate-hz --resume --playback --playback-as --tutor --listen --port --two-way --join --code --role --review --scan --procedure --sound --volume --alarms --monitor --monitor-setup --stream --stereo --stereo-base --experiment --require-approved --quality --width --height --scale --layout --full-screen --end-page --state-file --show-settings --side --seconds --fast --pieces" ;;
    replay) flags="$flags --case-folder --surface-out --bone-out" ;;
    playback) flags="$flags --out --mode --drills --pace --stiffness-n-per-mm --damping-n-s-per-m --forward --max-force-n --dead-zone-mm --tolerance-radius-mm --ramp-s --forget --trial-s --from-s --to-s --experts --headless --hand --device --case-folder --state-file" ;;
    tutor) flags="$flags --out --script --settings --resume --listen --port --two-way --stiffness-n-per-mm --max-force-n --min-trainees --wait-s" ;;
    join) flags="$flags --out --case-folder --code --role --hand --stiffness-n-per-mm --max-force-n --wait-s --silence-s" ;;
    score) flags="$flags --procedure --mirror --reference --subject --csv --evidence --heat --case-folder" ;;
    movie) flags="$flags --camera --speed --from-s --to-s --skip-idle --no-overlay --blind --size --fps --deep --case-folder" ;;
    goal-cavity) flags="$flags --out --procedure --mirror --session --burr-mm --approach" ;;
    review) flags="$flags --out --procedure --mirror --reference --subject --earlier --no-pictures --case-folder" ;;
    export) flags="$flags" ;;
    sound) flags="$flags --volume --alarms --case-folder" ;;
    heat) flags="$flags --cutting-share --diamond-w-per-n --water-c --film --cell-mm --report --case-folder" ;;
    nerve-monitor) flags="$flags --out --setup --channel --stimulator-ma --pulses-per-s --width-ms --search --hand --heat --case-folder" ;;
    stream) flags="$flags --to --setup --speed --listeners --wait-s --case-folder" ;;
    nerve-console) flags="$flags --sound --code --width --height --scale --state-file" ;;
    experiment) flags="$flags --out --targets --noise --crosstalk --reaction-s --participant --people --trials --device --headless --simulated --retention --null --experiments --chain --level --state-file" ;;
    ground-truth) flags="$flags --out --program --experiment --bone --trajectory --surface --columns --stiffness-n-per-mm --share" ;;
    study) flags="$flags --title --procedure --groups --competent --cases --items --attempts --lowest --highest --participant --group --case-name --attempt --mirror --accept --primary --rater --out --resamples --level --given --no-movies" ;;
    simulate-trainee) flags="$flags --out --skill --procedure --mirror --minutes --approach --goal --window-mm" ;;
    devices) flags="$flags --watch --recording" ;;
    markers) flags="$flags --paper --pen --page" ;;
    calibrate-camera) flags="$flags --out --seconds --width --height --fps --latency-ms" ;;
    calibrate-pen) flags="$flags --camera --out --pen --ruler-mm --seconds" ;;
    track-pen) flags="$flags --camera --pen --seconds" ;;
    deidentify) flags="$flags --out --key --map" ;;
    send) flags="$flags --peer --ae --timeout-s --tls-ca --tls-certificate --tls-key --dicomweb --dicomweb-login --dicomweb-ca --dry-run --check --deidentify --key" ;;
    fetch) flags="$flags --peer --ae --timeout-s --tls-ca --tls-certificate --tls-key --dicomweb --dicomweb-login --dicomweb-ca --out --study --series --accession --patient-id --date --modality --series-gb" ;;
    receive) flags="$flags --ae --bind --port --allow --allow-all --associations --object-gb --folder-gb --keep-free-gb --memory-mb --timeout-s --association-s --quiet-s --metrics --tls-ca --tls-certificate --tls-key" ;;
    watch-folder) flags="$flags --rules --out --quiet-s --poll-s --jobs --memory-mb --minutes --retries --keep-free-mb --orthanc --orthanc-login --orthanc-ca --timeout-s --object-gb --once --no-report --metrics" ;;
    doctor) flags="$flags --seconds --rate-hz --server --inbox --cases --rules --metrics --login --ae --allow --bind --port --keep-free-gb --jobs --memory-mb --no-report --tls-ca --tls-certificate --tls-key" ;;
    demo) flags="$flags --out --seconds --axes" ;;
    bench) flags="$flags" ;;
    docs) flags="$flags --check --shared" ;;
  esac
  case "$cur" in
    -*) COMPREPLY=($(compgen -W "$flags" -- "$cur")) ;;
    *) COMPREPLY=($(compgen -f -- "$cur")) ;;
  esac
}
complete -o filenames -F _osteo osteo ./osteo
