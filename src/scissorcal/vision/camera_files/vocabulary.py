"""Keys of camera files by what they mean: for the camera, or without effect on it.

Keys stand here in lower case without separators. Sources: OpenCV's calibration samples and
``interactive_calibration``; ``sensor_msgs/CameraInfo``, REP 104 and ``camera_calibration_parsers``
of ROS; the configurations of Kalibr, VINS-Fusion, ORB-SLAM3, OKVIS and EuRoC; ``rs2_intrinsics`` of
librealsense.
"""

import re


def _table(**words: str) -> dict[str, str]:
    return {name: role for role, names in words.items() for name in names.split()}


ROLES = _table(
    matrix="cameramatrix cameramat intrinsicmatrix intrinsicsmatrix intrinsic mtx kmatrix "
    "cameraintrinsicmatrix cameraintrinsics calibrationmatrix",
    intrinsics="intrinsics projectionparameters",
    distortion="distortioncoefficients distortioncoeffs distortioncoeff distortioncoefficient "
    "distcoeffs distcoeff distcoefs distcoef distcoefficients distortion distortions dist coeffs d "
    "lensdistortion cameradistortion distortionvector distortionparameters",
    group="camera lens",
    width="imagewidth width imgwidth picturewidth framewidth",
    height="imageheight height imgheight pictureheight frameheight",
    size="imagesize imgsize resolution imagedimension imagedimensions cameraresolution framesize "
    "imageresolution picturesize",
    shape="imageshape imgshape frameshape imagesizehw",
    model="cameramodel distortionmodel distortiontype modeltype model type projection",
    fx="fx fu",
    fy="fy fv",
    cx="cx ppx u0 pu",
    cy="cy ppy v0 pv",
    f="f",
    focal="focallength focallengthpx focallengthpixels",
    centre="principalpoint opticalcenter opticalcentre",
    k1="k1",
    k2="k2",
    p1="p1",
    p2="p2",
    k3="k3",
    k4="k4",
    k5="k5",
    k6="k6",
    zero="skew gamma s alphac b1 b2 k7 k8 p3 p4 s1 s2 s3 s4 taux tauy xi mu mv omega alpha beta "
    "mirrorparameters",
    one="imagescale scale scalefactor downsample downscale resizefactor decimation",
    binning="binningx binningy binning",
    roi="roi regionofinterest crop",
    done="success valid calibrated",
    rms="avgreprojectionerror rms",
)
STRUCTURED = _table(
    matrix="k k1 m1 cameramatrix1 m",
    distortion="d1 distcoeffs1",
    second="k2 m2 d2 cameramatrix2 distcoeffs2",
    ignored="p p1 p2 r r1 r2 t t1 t2",
)
"""Keys that mean something else where their value is a list or a mapping."""

SCALAR = _table(unknown="k d m")
"""Keys that mean something else where their value is one number."""

GROUPS = {"group", "matrix", "intrinsics", "distortion", "size", "focal", "centre"}
"""Meanings whose value may be a mapping of named numbers."""

OWN = ("matrix", "intrinsics", "fx", "f", "focal")
"""Meanings that state a focal length."""

OF_A_CAMERA = {name for name, role in ROLES.items() if role in ("matrix", "intrinsics", "fx")}
OF_A_CAMERA |= {"k", "m1", "cameramatrix1", "focallength"}

HEADS = _table(
    camera="camera camera1",
    second="camera2 left right",
    ignored="orbextractor viewer imu stereo rgbd system file loopclosing initializer",
)
"""What stands before the point in ORB-SLAM's keys; with LEFT and RIGHT, Camera is rectified."""

MODEL_KEY = re.compile(
    r"(cam|camera|distortion|lens|projection|intrinsics?|calibration)\w*(model|type)(name)?|"
    r"model(name|type)|(distortion|projection)(name|kind)"
)

IGNORED = set(
    _table(
        record="date time timestamp stamp created createdat generated calibratedat author operator "
        "user name id uuid serial serialnumber serialno vendor manufacturer product comment "
        "comments note notes info description version software source header seq "
        "frameid topic rostopic path file filename image images imagefiles imagelist "
        "imagefolder imagedir schema generator opencv typeid index device port gain",
        calibration="rmse totalerror meanerror error errors nframes nrofframes framescount "
        "framecount numframes numberofimages imagecount imagesused viewsretained totalviews "
        "numviews views boardwidth boardheight boardsize boardtype board pattern target "
        "patternsize patterntype squaresx squaresy dictionary rows cols flag flags flagvalue "
        "calibrationflags aspectratio fixaspectratio usefixedaspectratio "
        "extrinsicparameters extrinsic extrinsics imagepoints gridpoints objectpoints "
        "objpoints imgpoints rvec rvecs tvec tvecs rotationvectors translationvectors "
        "covariance calibrationtime calibrationdate",
        rig="r p t e q rectificationmatrix projectionmatrix newcameramatrix optimalcameramatrix "
        "optimalnewcameramatrix newcamera roi1 roi2 camoverlaps timeshiftcamimu sensortype "
        "ratehz fps framerate rgb bf rpmax newwidth newheight thdepth depthmapfactor fovx fovy",
        vins="imu numofcam imutopic image0topic image1topic imagetopic outputpath cam0calib "
        "multiplethread maxcnt mindist freq fthreshold showtrack flowback equalize "
        "maxsolvertime maxnumiterations keyframeparallax accn gyrn accw gyrw gnorm "
        "estimatetd td rollingshutter rollingshuttertr loadpreviousposegraph "
        "posegraphsavepath saveimage visualizeimuforward visualizecamerasize loopclosure "
        "fastrelocalization estimateextrinsic excalibresultpath extrinsicrotation "
        "extrinsictranslation",
    )
)
"""Keys that say nothing about how a point becomes a pixel of the camera's own picture."""

IGNORED_KINDS = re.compile(
    r"\w*(reprojection|reproj)\w*|\w*(stddev|stdev)\w*|\w*rmse?(px|error)|numimages\w*|"
    r"(square|marker)(size|length)\w*|(chess|checker|charuco)\w*|aruco\w*|innercorners\w*|"
    r"t(cam|cn|bs|sc|bc|sb|ic|imu)\w*|bodytcam\d*|[hvd]fov\w*|exposure\w*|validroi\w*|"
    r"(camera|lens|sensor|calibration|file|user|board|device|serial)"
    r"(serial|file|info)?(name|date|time|id|number|topic|version|path|comment|notes?)|"
    r"(created|generated|calibrated|saved)(at|on|by|with|utc|date|time)*"
)
